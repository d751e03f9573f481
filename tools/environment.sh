# What the tools share: where things are, which tests are the kernels', and an OpenCL that works. Sourced, not run.
# shellcheck shell=bash

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)

# What holds kernels against double precision, and small renders. Left out: what would take Oclgrind minutes.
# shellcheck disable=SC2034  # test-drivers and test-device read it
kernel_tests='Types.*:SelfTest.*:Boundary.*:Evaluation.*:*BssrdfOnDevice.*:Raster.*:Clipping.*:Visibility.Nearest*'
kernel_tests+=':*LightMap.*:Guides.*:*GuidesOf.*:Layers.*:*LayersReplay.*:Pyramids.*:Gather.*'
kernel_tests+=':-*SamplesAreCentred*/0:Gather.PixelsThatNoLayerSees*'

# A folder in which this user can build this source: $1 in it, or one in the user's cache where $1 can't be written or
# belongs to a copy of the source elsewhere (a container's, say).
build_folder() {
  local folder=$root/$1 writable=$root key
  if [[ -e $folder ]]; then writable=$folder; fi
  if [[ -w $writable ]] && { [[ ! -e $folder/CMakeCache.txt ]] ||
    grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$folder/CMakeCache.txt"; }; then
    printf '%s\n' "$folder"
  else
    key=$(cksum <<<"$root")
    printf '%s\n' "${XDG_CACHE_HOME:-${HOME:?}/.cache}/parian/${key%% *}/$1"
  fi
}

# Whether apt knows what packages this system has.
apt_index() {
  local file
  while read -r file; do
    if [[ -e $file ]]; then return; fi
  done < <(apt-get indextargets --format "\$(FILENAME)" 'Created-By: Packages' 2>/dev/null)
  return 1
}

# Whether this system has no package $1; false where nothing is known.
lacks() {
  local candidate
  candidate=$(LC_ALL=C apt-cache policy "$1" 2>/dev/null | sed -n 's/^  Candidate: \([^(].*\)/\1/p') || return 1
  [[ -z $candidate ]] && apt_index
}

# need PROGRAM: goes on if it's there. Else ends what asks: skipped, where this system has no package of that name.
need() {
  if command -v "$1" >/dev/null; then return; fi
  if lacks "$1"; then
    echo "skipped: this system has no $1"
    exit
  fi
  echo "tools/${0##*/}: $1 is needed; tools/packages test installs it" >&2
  exit 1
}

# The Clang that reads this system's libclc; Debian 12's where that isn't known.
clang_of_libclc() {
  local owner
  owner=$(dpkg-query -S /usr/lib/clc/amdgcn--amdhsa.bc 2>/dev/null) || owner=libclc-15:
  owner=${owner%%:*}
  printf 'clang-%s\n' "${owner##*-}"
}

# The Clang whose sanitizers tools/test takes: 14 compiles them soonest.
sanitizing_clang() {
  if command -v clang-14 >/dev/null; then echo clang-14; else clang_of_libclc; fi
}

# PoCL asks hwloc for processors and memory, and stops the process where there is no sysfs, as in a plain chroot.
if [[ ! -d /sys/devices/system/cpu && -z ${HWLOC_SYNTHETIC-} ]]; then
  memory=$(sed -n 's/^MemTotal: *\([0-9]*\) kB$/\1/p' /proc/meminfo)
  HWLOC_SYNTHETIC="pack:1 [numa(memory=${memory:-4194304}kB)] core:$(nproc) pu:1"
  export HWLOC_SYNTHETIC
fi
