# Writes the manual page from what the command says of itself. Run by the build:
# cmake -DPARIAN=… -DOUTPUT=… -P manual.cmake
cmake_minimum_required(VERSION 3.24)
string(ASCII 1 semicolon)  # stands for one, which would divide lists

# What `parian ARGN` prints, as a list of lines in which CMake finds none of its own syntax.
function(ask result)
  execute_process(COMMAND ${PARIAN} ${ARGN} OUTPUT_VARIABLE text OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX REPLACE "\n                +" "   " text "${text}")  # an option too long for its column
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  string(REPLACE ";" ${semicolon} text "${text}")
  string(REPLACE "[" "\\(lB" text "${text}")
  string(REPLACE "]" "\\(rB" text "${text}")
  string(REPLACE "\n" ";" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

# Lines of help as roff: headings, "  option   what it does" as tagged paragraphs, the rest line by line.
function(append_help lines)
  foreach(line IN LISTS lines)
    if(line MATCHES "^  (.*[^ ])   *([^ ].*)$")
      string(APPEND page ".TP\n\\fB${CMAKE_MATCH_1}\\fR\n\\&${CMAKE_MATCH_2}\n")
    elseif(line MATCHES "^([A-Z][A-Za-z ]*):$")
      string(APPEND page ".SS ${CMAKE_MATCH_1}\n")
    elseif(line STREQUAL "")
      string(APPEND page ".PP\n")
    else()
      string(APPEND page "\\&${line}\n.br\n")
    endif()
  endforeach()
  string(REGEX REPLACE "(\n\\.PP)+(\n\\.SS)" "\\2" page "${page}")
  set(page "${page}" PARENT_SCOPE)
endfunction()

ask(version --version)
ask(help --help)
list(POP_FRONT help summary)
string(REGEX REPLACE "^Parian (.*)\\.$" "\\1" summary "${summary}")
set(page ".\\\" Made by tools/manual.cmake from the command's --help.\n")
string(APPEND page ".TH PARIAN 1 \"\" \"${version}\" \"User Commands\"\n")
string(APPEND page ".SH NAME\nparian \\- ${summary}\n.SH SYNOPSIS\n\\fBparian\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n"
  ".SH DESCRIPTION\n")
list(POP_FRONT help)
append_help("${help}")
set(commands ${help})
list(FILTER commands INCLUDE REGEX "^  [a-z]+  ")
foreach(command IN LISTS commands)
  string(REGEX REPLACE "^  ([a-z]+) .*" "\\1" command "${command}")
  ask(help ${command} --help)
  list(POP_FRONT help summary usage)
  string(REGEX REPLACE "^Usage: " "" usage "${usage}")
  string(APPEND page ".SH PARIAN ${command}\n\\fB${usage}\\fR\n.PP\n\\&${summary}\n")
  append_help("${help}")
endforeach()
string(REPLACE ${semicolon} ";" page "${page}")
file(WRITE ${OUTPUT} "${page}")
