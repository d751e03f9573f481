# Writes the kernels (in order, #line-marked, without their own #include lines) and the table of materials as one
# C++ file of string literals. Run by the build:
# cmake -DOUTPUT=… -DVERSION=… -DKERNELS=… -DBENCH_KERNELS=… -DMATERIALS=… -P embed.cmake

# A C++ raw string may hold 64 KiB at most by the standard, so text goes in as pieces, one per file.
function(append_program name)
  string(APPEND text "const char* const ${name} =\n")
  foreach(file ${ARGN})
    file(READ ${file} source)
    get_filename_component(file_name ${file} NAME)
    string(REGEX REPLACE "#include \"[^\n]*\"" "" source "${source}")
    string(APPEND text "R\"__(#line 1 \"kernels/${file_name}\"\n${source})__\"\n")
  endforeach()
  set(text "${text};\n\n" PARENT_SCOPE)
endfunction()

set(text "// Made by tools/embed.cmake from kernels/ and host/src/materials.csv.\n#include \"embedded.hpp\"\n\n")
string(APPEND text "namespace parian {\n\nconst char* const version = \"${VERSION}\";\n\n")
append_program(kernel_sources ${KERNELS})
append_program(bench_sources ${BENCH_KERNELS})
file(READ ${MATERIALS} table)
string(APPEND text "const char* const materials_table = R\"__(${table})__\";\n\n}  // namespace parian\n")
file(WRITE ${OUTPUT} "${text}")
