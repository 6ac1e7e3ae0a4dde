# Everything that `make install PREFIX=` writes. The tree may be moved afterwards: the command finds the
# library by a relative rpath, the library finds the plugins beside itself, deform.pc and the CMake package
# count from their own place.
include(CMakePackageConfigHelpers)

set(deform_plugin_dir ${CMAKE_INSTALL_LIBDIR}/deform/${DFM_ABI_DIR})
set(deform_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/deform)
file(RELATIVE_PATH deform_bin_to_lib /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
file(RELATIVE_PATH deform_pc_to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" deform_pc_to_prefix ${deform_pc_to_prefix})

if(TARGET deform_cli)
  # The build tree has the same run paths as the installed one. With a run path of its own CMake would pad it
  # with empty entries to the length of the installed one, and the dynamic linker reads an empty entry as the
  # current folder: a library lying there would be loaded.
  set(deform_cli_rpath "$ORIGIN/${deform_bin_to_lib}")
  if(NOT deform_bin_to_lib STREQUAL "../lib")
    list(APPEND deform_cli_rpath "$ORIGIN/../lib")   # where the build tree has it
  endif()
  set_target_properties(deform_cli ${deform_tools} PROPERTIES INSTALL_RPATH "${deform_cli_rpath}"
    BUILD_WITH_INSTALL_RPATH ON)
  install(TARGETS deform_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
endif()
# What follows where it was built: `make install` and `make deb` build it, `make demo` may not.
if(deform_tools)
  install(TARGETS ${deform_tools} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command OPTIONAL)
endif()
foreach(viewer view serve)
  if(TARGET deform_${viewer})
    set_target_properties(deform_${viewer} PROPERTIES INSTALL_RPATH "${deform_cli_rpath}"
      BUILD_WITH_INSTALL_RPATH ON)
    install(TARGETS deform_${viewer} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${viewer} OPTIONAL)
  endif()
endforeach()
install(TARGETS deform deform_headers EXPORT deformTargets
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT library
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
get_property(deform_plugins GLOBAL PROPERTY DEFORM_PLUGINS)
if(deform_plugins)
  install(TARGETS ${deform_plugins} LIBRARY DESTINATION ${deform_plugin_dir} COMPONENT library)
endif()
# Under the GPL: no part of what is installed unless it is asked for by name.
if(TARGET solver_cholmod)
  install(TARGETS solver_cholmod LIBRARY DESTINATION ${deform_plugin_dir} COMPONENT cholmod EXCLUDE_FROM_ALL)
endif()
if(TARGET solver_petsc)
  set(where ${CMAKE_INSTALL_LIBDIR}/deform/petsc)
  install(TARGETS solver_petsc deform-petsc-rank LIBRARY DESTINATION ${where} COMPONENT petsc EXCLUDE_FROM_ALL
    RUNTIME DESTINATION ${where} COMPONENT petsc EXCLUDE_FROM_ALL)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/libdeform/include/deform DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT dev FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
install(FILES ${PROJECT_SOURCE_DIR}/libdeform/schema/deform-scene.schema.json
  ${PROJECT_SOURCE_DIR}/libdeform/schema/deform-cost.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/deform
  COMPONENT command)
# For `python -m deform demo`.
install(FILES ${PROJECT_SOURCE_DIR}/examples/scenes/two_cylinders.json
  DESTINATION ${CMAKE_INSTALL_DATADIR}/deform/scenes COMPONENT command)
install(FILES ${PROJECT_SOURCE_DIR}/examples/data/cylinder_thick.msh
  ${PROJECT_SOURCE_DIR}/examples/data/cylinder_slim.msh
  DESTINATION ${CMAKE_INSTALL_DATADIR}/deform/data COMPONENT command)
# Plugins to copy and edit, as source.
file(GLOB deform_templates ${PROJECT_SOURCE_DIR}/plugins/template_*)
install(DIRECTORY ${deform_templates} DESTINATION ${CMAKE_INSTALL_DATADIR}/deform COMPONENT dev)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT library)
# What is inside of the programs and libraries, and its licenses: where Python, ninja and dpkg can tell.
if(PROJECT_IS_TOP_LEVEL AND DEFORM_SHARED AND NOT CMAKE_CROSSCOMPILING)
  include(DeformPython)
  set(files "")
  foreach(target deform deform_cli deform_view deform_serve deform_ode deform_bullet deform_bullet64
      deform_python deform_python_serve libdeform_python_law solver_cholmod ${deform_tools} ${deform_plugins})
    if(TARGET ${target})
      list(APPEND files $<TARGET_FILE:${target}>)
    endif()
  endforeach()
  list(JOIN files "\" \"" files)
  if(Python3_Interpreter_FOUND)
    install(CODE "execute_process(COMMAND \"${DEFORM_PYTHON}\" -B
        \"${PROJECT_SOURCE_DIR}/cmake/packaging/sbom.py\" \"${PROJECT_BINARY_DIR}\"
        \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DOCDIR}\"
        ${PROJECT_VERSION} \"${files}\" COMMAND_ERROR_IS_FATAL ANY)" COMPONENT library)
  endif()
endif()
# The pages, in the places that they have in the source tree, so that links between them hold; and what they
# link to outside of their folder, which abi.installed_tree checks.
foreach(page README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md tests/README.md tests/abi/kept/README.md
    tests/bench/friction/README.md tests/bench/results/rest_compression.csv
    tests/bench/results/scene_models.csv libdeform/include/deform/attach.h
    libdeform/include/deform/tool.h libdeform/src/cut/blade_sweep.h)
  get_filename_component(folder ${page} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/${page} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder} COMPONENT doc)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/libdeform/doc DESTINATION ${CMAKE_INSTALL_DOCDIR}/libdeform
  COMPONENT doc PATTERN __pycache__ EXCLUDE)

# The adapters of rigid engines have exports of their own, so that who does not ask for one
# (find_package(deform COMPONENTS ode)) needs no engine.
set(deform_adapters "")
foreach(adapter ode bullet bullet64)
  if(TARGET deform_${adapter})
    list(APPEND deform_adapters ${adapter})
    string(REGEX REPLACE "64$" "" folder ${adapter})
    install(TARGETS deform_${adapter} EXPORT deform_${adapter}Targets
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${adapter}
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${adapter})
    set_target_properties(deform_${adapter} PROPERTIES INSTALL_RPATH "$ORIGIN" BUILD_WITH_INSTALL_RPATH ON)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/bindings/${folder}/include/deform
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT ${folder}
      FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
    install(EXPORT deform_${adapter}Targets NAMESPACE deform:: DESTINATION ${deform_cmake_dir}
      COMPONENT ${adapter})
  endif()
endforeach()

install(EXPORT deformTargets NAMESPACE deform:: DESTINATION ${deform_cmake_dir} COMPONENT dev)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/deformConfig.cmake.in
  ${PROJECT_BINARY_DIR}/cmake/deformConfig.cmake
  INSTALL_DESTINATION ${deform_cmake_dir} PATH_VARS deform_plugin_dir)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cmake/deformConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cmake/deformConfig.cmake
  ${PROJECT_BINARY_DIR}/cmake/deformConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/DeformPlugin.cmake ${PROJECT_SOURCE_DIR}/cmake/deform_plugin.map
  ${PROJECT_SOURCE_DIR}/cmake/plugin_mingw.cpp
  DESTINATION ${deform_cmake_dir} COMPONENT dev)

# An archive is all there is to link then, so `pkg-config --libs` names what it needs even without --static.
set(deform_pc_needs "")
if(NOT DEFORM_SHARED)
  set(deform_pc_needs " -lstdc++ -lm -pthread")
  if(DEFORM_ZLIB)
    string(PREPEND deform_pc_needs " -lz")
  endif()
  if(NOT DEFORM_PLUGINS_STATIC)
    string(APPEND deform_pc_needs " -ldl")
  endif()
endif()
set(deform_pc_plugin_dir "\${prefix}/${deform_plugin_dir}")
if(DEFORM_PLUGINS_STATIC)
  set(deform_pc_plugin_dir "")
endif()
configure_file(${PROJECT_SOURCE_DIR}/cmake/deform.pc.in ${PROJECT_BINARY_DIR}/cmake/deform.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/cmake/deform.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
  COMPONENT dev)
set(deform_adapter_pc_private "")
if(NOT DEFORM_SHARED)
  set(deform_adapter_pc_private "-lstdc++ -lm")
endif()
set(engine_ode "the Open Dynamics Engine, double precision")
set(engine_bullet "Bullet, single precision")
set(engine_bullet64 "Bullet, double precision")
set(requires_ode "ode >= 0.16 ode < 0.17")
set(requires_bullet "bullet >= 3.24 bullet < 4")
set(requires_bullet64 "bullet-float64 >= 3.24 bullet-float64 < 4")
foreach(adapter IN LISTS deform_adapters)
  set(deform_pc_engine ${engine_${adapter}})
  set(deform_pc_requires ${requires_${adapter}})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/deform_adapter.pc.in
    ${PROJECT_BINARY_DIR}/cmake/deform_${adapter}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/cmake/deform_${adapter}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
    COMPONENT ${adapter})
endforeach()
if(PROJECT_IS_TOP_LEVEL AND DEFORM_CLI)
  include(DeformPackage)
endif()
