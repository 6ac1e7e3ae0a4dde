# Emscripten, wherever it lies: Debian's or an emsdk that is active. What both lack is set here.
find_program(DEFORM_EM_CONFIG em-config REQUIRED)
execute_process(COMMAND ${DEFORM_EM_CONFIG} EMSCRIPTEN_ROOT OUTPUT_VARIABLE root
  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
include(${root}/cmake/Modules/Platform/Emscripten.cmake)
# Exceptions and vectors as the processor has them; one thread.
set(CMAKE_CXX_FLAGS_INIT "-fwasm-exceptions -msimd128")
set(CMAKE_C_FLAGS_INIT "-msimd128")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-fwasm-exceptions")
# Debian's linker finds its parser of JavaScript only where it is told.
if(EXISTS /usr/share/nodejs/acorn)
  set(CMAKE_C_LINKER_LAUNCHER ${CMAKE_COMMAND} -E env NODE_PATH=/usr/share/nodejs)
  set(CMAKE_CXX_LINKER_LAUNCHER ${CMAKE_C_LINKER_LAUNCHER})
endif()
set(DEFORM_OTHER_SYSTEM ON)
# Of every program.
set(DEFORM_WASM_LINK -sALLOW_MEMORY_GROWTH=1 -sTOTAL_STACK=4MB)
