# Flags that every target of ours is built with. The number rules of the house (same bits for every vector
# width and compiler) need -ffp-contract=off and no fast-math, and a square root that is the processor's
# instruction: mingw's sqrt(), which sets errno, rounds twice. Kernels get their wide flags per file, see
# deform_kernel_flags.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_EXTENSIONS OFF)
if(NOT EMSCRIPTEN)   # one program of everything, which lies nowhere else
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
endif()
set(CMAKE_C_VISIBILITY_PRESET hidden)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -g1")
set(CMAKE_C_FLAGS_RELEASE "-O2 -g1")
# Build type of the sanitizer presets.
set(CMAKE_CXX_FLAGS_SANITIZE "-O1 -g1")
set(CMAKE_C_FLAGS_SANITIZE "-O1 -g1")

# The linker's hash of debug information, which names folders, is all in which two builds would differ.
if(PROJECT_IS_TOP_LEVEL AND CMAKE_SYSTEM_NAME STREQUAL "Linux")
  add_link_options(-Wl,--build-id=none)
endif()

# Plugins of one ABI lie in a folder of their own; the header says which ABI that is.
set(deform_plugin_header ${CMAKE_CURRENT_LIST_DIR}/../libdeform/include/deform/plugin.h)
file(STRINGS ${deform_plugin_header} deform_abi REGEX "^#define DFM_ABI ")
string(REGEX MATCH "[0-9]+" deform_abi "${deform_abi}")
set(DFM_ABI_DIR plugins-${deform_abi})
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${deform_plugin_header})

add_library(deform_flags INTERFACE)
target_compile_options(deform_flags INTERFACE -ffp-contract=off -fno-math-errno -Wall -Wextra
  -Wno-unused-parameter)
# Where files are compiled together, a local name may be another file's own.
target_compile_options(deform_flags INTERFACE $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow>)
if(DEFORM_WERROR)
  target_compile_options(deform_flags INTERFACE -Werror)
elseif(NOT PROJECT_IS_TOP_LEVEL)
  # The host's flags come first and hold here too: its -Werror is not for our warnings.
  target_compile_options(deform_flags INTERFACE -w)
endif()
if(NOT PROJECT_IS_TOP_LEVEL)
  add_compile_options(-fno-fast-math)           # behind the host's options and before those of targets
  set(CMAKE_UNITY_BUILD OFF)                    # files have names of their own in anonymous namespaces
  set(CMAKE_INTERPROCEDURAL_OPTIMIZATION OFF)   # wide kernels stay apart
endif()
if(DEFORM_SANITIZE)
  add_compile_options(-fsanitize=${DEFORM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${DEFORM_SANITIZE})
  # What the library's checks call: clang links it into C++ programs alone.
  add_link_options("$<$<LINK_LANG_AND_ID:C,Clang>:-fsanitize-link-c++-runtime;-lstdc++>")
  # AddressSanitizer finds what the first three look for as it is accessed. Where bytes are read as numbers,
  # in the readers of files and snapshots, the preset `fuzz` checks alignment. The four are half of what the
  # sanitizers add to the compiler's work (doc/decisions/structure.md).
  if(DEFORM_SANITIZE STREQUAL "address,undefined")
    add_compile_options(-fno-sanitize=null,object-size,pointer-overflow,alignment)
  endif()
endif()

# Files named *_kernel_avx2.cpp and *_kernel_avx512.cpp are compiled for those instruction sets and chosen at
# run time; on other processors than x86-64 deform_own_sources takes them out of a list. AVX-512 cannot be had
# without FMA (clang turns it off with -mno-fma); -ffp-contract=off keeps it unused, and a test looks into the
# objects. UndefinedBehaviorSanitizer checks their sources as they are compiled for the narrowest vectors.
# The compiler says what it compiles for, as to the code that calls them: -m32 changes no name of a processor.
include(CheckCXXSourceCompiles)
check_cxx_source_compiles("#ifndef __x86_64__\n#error\n#endif\nint main() { return 0; }" DEFORM_X86_64)
check_cxx_source_compiles("#include <version>
#if !defined(_LIBCPP_VERSION) || _LIBCPP_VERSION >= 200000
#error
#endif
int main() { return 0; }" DEFORM_OLD_LIBCXX)
if(DEFORM_OLD_LIBCXX)
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:SHELL:-include \"${CMAKE_CURRENT_LIST_DIR}/libcxx.h\">")
endif()
# What is the system's lies in files named *_posix.cpp and *_windows.cpp.
macro(deform_own_sources list)
  if(WIN32)
    list(FILTER ${list} EXCLUDE REGEX "_posix\\.cpp$")
  else()
    list(FILTER ${list} EXCLUDE REGEX "_windows\\.cpp$")
  endif()
  if(NOT DEFORM_X86_64)
    list(FILTER ${list} EXCLUDE REGEX "_kernel_avx[0-9]+\\.cpp$")
  endif()
endmacro()
function(deform_kernel_flags)
  # A stack of Windows is aligned to 16 bytes, which gcc does not correct for wider vectors (its bug 54412).
  set(wide "")
  if(WIN32)
    set(wide ";-Wa,-muse-unaligned-vector-move")
  endif()
  set(once "")
  # clang takes 22 s for AddressSanitizer's checks within a long function, 6 s for calls of them.
  set(called "")
  if(DEFORM_SANITIZE MATCHES "undefined")
    set(once ";-fno-sanitize=undefined")
    if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
      set(called ";-mllvm;-asan-instrumentation-with-call-threshold=500")
    endif()
  endif()
  foreach(file IN LISTS ARGN)
    if(file MATCHES "_kernel_avx2\\.cpp$")
      set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "-mavx2;-mno-fma${wide}${once}${called}"
        SKIP_PRECOMPILE_HEADERS ON)
    elseif(file MATCHES "_kernel_avx512\\.cpp$")
      set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS
        "-mavx512f;-mavx512vl;-mavx512dq;-mprefer-vector-width=512${wide}${once}${called}"
        SKIP_PRECOMPILE_HEADERS ON)
    elseif(file MATCHES "_kernel_sse2\\.cpp$")
      set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "${called}")
    endif()
  endforeach()
endfunction()

# The reader of scenes and the command compute little: without the dear passes of the optimizer they are
# compiled in half the time.
function(deform_computes_little target)
  if(DEFORM_SANITIZE AND NOT DEFORM_FUZZ)   # fuzzers spend their time in the reader of scenes
    target_compile_options(${target} PRIVATE -O0)
  else()
    target_compile_options(${target} PRIVATE $<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:-Og>)
  endif()
endfunction()

# The standard library's headers, parsed once per target: a third of what a file costs to compile. Builds by
# gcc without a sanitizer do without: out of a precompiled header gcc 12 warns of the standard library's own
# code (its bug 105329), and in `dev` a file that lacks an #include is an error. Files with flags of their own
# cannot share the headers. A host that builds the library within its own project decides for itself.
function(deform_precompile target)
  if(NOT PROJECT_IS_TOP_LEVEL OR (CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT DEFORM_SANITIZE))
    return()
  endif()
  target_precompile_headers(${target} PRIVATE <algorithm> <array> <atomic> <cmath> <cstdint> <cstdio>
    <cstring> <functional> <map> <memory> <mutex> <optional> <span> <string> <vector>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict)
  endif()
endfunction()

# DEFORM_UNITY compiles files of a folder together, for a third of the work: what costs is headers and
# templates, the same ones in each file. All presets but dev, clang and static_clang use it.
# cmake/unity_groups.py keeps apart what collides, anew when a file changes. Where each file is compiled by
# itself, a missing #include of ours is an error: in dev, where the standard's is one, too, and in CI's
# static_clang.
if(DEFORM_UNITY)
  include(DeformPython)
  # gcc collects its garbage from 128 MB on: a tenth of its time where files are compiled together.
  add_compile_options($<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=ggc-min-heapsize=500000>)
endif()
function(deform_unity target)
  if(NOT DEFORM_UNITY)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  get_target_property(folder ${target} SOURCE_DIR)
  deform_unity_groups(${folder} ${sources})
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # for gcc, what is not in the first file might be in several
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# Sets UNITY_GROUP of those of the sources (of FOLDER) that have no flags of their own. <windows.h> defines
# words of other files.
function(deform_unity_groups folder)
  set(together "")
  foreach(file IN LISTS ARGN)
    get_filename_component(file ${file} ABSOLUTE BASE_DIR ${folder})
    get_source_file_property(own ${file} COMPILE_OPTIONS)
    if(file MATCHES "\\.cpp$" AND NOT file MATCHES "_kernel[^/]*$|_windows\\.cpp$" AND NOT own)
      list(APPEND together ${file})
    endif()
  endforeach()
  set(root ${PROJECT_SOURCE_DIR})
  set(seen libdeform/src libdeform/include bindings bindings/cli bindings/tools tests/support)
  list(TRANSFORM seen PREPEND ${root}/)
  list(JOIN seen ":" seen)
  execute_process(COMMAND ${DEFORM_PYTHON} -B ${root}/cmake/unity_groups.py 18
    "${seen}" ${together}
    OUTPUT_VARIABLE groups OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\n" ";" groups "${groups}")
  foreach(line IN LISTS groups)
    string(REGEX MATCH "^([^ ]+) (.*)$" line "${line}")
    set_source_files_properties("${CMAKE_MATCH_2}" PROPERTIES UNITY_GROUP ${CMAKE_MATCH_1})
  endforeach()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${together} ${root}/cmake/unity_groups.py)
endfunction()
