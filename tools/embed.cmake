# Writes the kernels (in order, #line-marked, without their own #include lines) and the table of materials as one
# C++ file of string literals. Run by the build: cmake -DOUTPUT=… -DVERSION=… -DKERNELS=… -DMATERIALS=… -P embed.cmake

# A C++ raw string may hold 64 KiB at most by the standard, so text goes in as pieces, one per file.
set(text "// Made by tools/embed.cmake from kernels/ and host/src/materials.csv.\n#include \"embedded.hpp\"\n\n")
string(APPEND text "namespace parian {\n\nconst char* const version = \"${VERSION}\";\n\nconst char* const kernel_sources =\n")
foreach(file ${KERNELS})
  file(READ ${file} source)
  get_filename_component(name ${file} NAME)
  string(REGEX REPLACE "#include \"[^\n]*\"" "" source "${source}")
  string(APPEND text "R\"__(#line 1 \"kernels/${name}\"\n${source})__\"\n")
endforeach()
file(READ ${MATERIALS} table)
string(APPEND text ";\n\nconst char* const materials_table = R\"__(${table})__\";\n\n}  // namespace parian\n")
file(WRITE ${OUTPUT} "${text}")
