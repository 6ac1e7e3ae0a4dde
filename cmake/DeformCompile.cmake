# Flags that every target of ours is built with. The number rules of the house (same bits for every vector
# width and compiler) need -ffp-contract=off and no fast-math; kernels get their wide flags per file, see
# deform_kernel_flags.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 99)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
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

# Plugins of one ABI lie in a folder of their own; the header says which ABI that is.
set(deform_plugin_header ${CMAKE_CURRENT_LIST_DIR}/../libdeform/include/deform/plugin.h)
file(STRINGS ${deform_plugin_header} deform_abi REGEX "^#define DFM_ABI ")
string(REGEX MATCH "[0-9]+" deform_abi "${deform_abi}")
set(DFM_ABI_DIR plugins-${deform_abi})
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${deform_plugin_header})

add_library(deform_flags INTERFACE)
target_compile_options(deform_flags INTERFACE -ffp-contract=off -Wall -Wextra -Wshadow -Wno-unused-parameter)
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
endif()

# Files named *_kernel_avx2.cpp and *_kernel_avx512.cpp are compiled for those instruction sets and chosen at
# run time. AVX-512 cannot be had without FMA (clang turns it off with -mno-fma); -ffp-contract=off keeps it
# unused, and a test looks into the objects.
function(deform_kernel_flags)
  foreach(file IN LISTS ARGN)
    if(file MATCHES "_kernel_avx2\\.cpp$")
      set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS "-mavx2;-mno-fma"
        SKIP_PRECOMPILE_HEADERS ON)
    elseif(file MATCHES "_kernel_avx512\\.cpp$")
      set_source_files_properties(${file} PROPERTIES COMPILE_OPTIONS
        "-mavx512f;-mavx512vl;-mavx512dq;-mprefer-vector-width=512" SKIP_PRECOMPILE_HEADERS ON)
    endif()
  endforeach()
endfunction()

# The standard library's headers, parsed once per target: a third of what a file costs to compile. Builds by
# gcc without a sanitizer do without: out of a precompiled header gcc 12 warns of the standard library's own
# code (its bug 105329), and there a file that lacks an #include is an error. Files with flags of their own
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
