# deform_add_plugin(NAME SOURCE...) builds a plugin that exports dfm_plugin_entry alone, with the number rules
# of the library. deform_add_static_plugin(NAME SOURCE...) builds the same sources as an archive to link into
# a program; the entry is then called dfm_plugin_entry_NAME, and the program hands it to
# dfm_plugin_register_static.

# Templates of the standard library are visible in ELF whatever the compiler is told: the map hides them. On
# other systems only what is marked is exported.
function(deform_exports target map)
  if(NOT WIN32 AND NOT APPLE)
    target_link_options(${target} PRIVATE -Wl,--version-script=${map})
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${map})
  endif()
endfunction()

function(deform_plugin_rules name)
  if(COMMAND deform_kernel_flags)
    deform_kernel_flags(${ARGN})
  endif()
  if(TARGET deform::headers)
    target_link_libraries(${name} PRIVATE deform::headers)
  else()
    target_link_libraries(${name} PRIVATE deform::deform_headers)
  endif()
  target_compile_options(${name} PRIVATE -ffp-contract=off -fno-math-errno)
  target_link_libraries(${name} PRIVATE m)   # sqrt of a law in C; a host need not have it
  set_target_properties(${name} PROPERTIES C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON)
endfunction()

function(deform_add_static_plugin name)
  add_library(${name} STATIC ${ARGN})
  deform_plugin_rules(${name} ${ARGN})
  target_compile_definitions(${name} PRIVATE DFM_STATIC_PLUGIN=${name})
endfunction()

function(deform_add_plugin name)
  add_library(${name} MODULE ${ARGN})
  deform_plugin_rules(${name} ${ARGN})
  set_target_properties(${name} PROPERTIES PREFIX "")
  deform_exports(${name} ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/deform_plugin.map)
  if(MINGW AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND "${ARGN}" MATCHES "\\.(cpp|cc|cxx)(;|$)")
    target_sources(${name} PRIVATE ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/plugin_mingw.cpp)
    target_link_options(${name} PRIVATE -static)   # a run-time library of its own
  endif()
endfunction()
