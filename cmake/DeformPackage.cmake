# Debian packages of what is installed: `make deb`. One per component, so that who runs scenes needs no
# headers, and who has no engine none of its adapters.
#
#   libdeform0          library and plugins
#   libdeform-dev       headers, CMake package, deform.pc, templates of plugins
#   libdeform-doc       the pages
#   deform              the command
#   deform-view         the window of `deform view`; where it was built
#   deform-serve        the server of `deform serve`; the same
#   libdeform-ode       adapter for ODE: library, header, CMake package, .pc
#   libdeform-bullet    adapter for Bullet, for both of its precisions
#   python3-deform      the Python package, on the library of libdeform0
#   libdeform-cholmod   solver_cholmod, under the GPL; where it was built (-DDEFORM_CHOLMOD=ON)
if(NOT DEFORM_SHARED OR DEFORM_PLUGINS_STATIC)
  return()
endif()
# The Python package looks for its library in `native`, which is the prefix here.
set(deform_python_dir lib/python3/dist-packages/deform)
file(CREATE_LINK ../../../.. ${PROJECT_BINARY_DIR}/cmake/native SYMBOLIC)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/bindings/python/deform DESTINATION lib/python3/dist-packages
  COMPONENT python_package EXCLUDE_FROM_ALL PATTERN __pycache__ EXCLUDE)
install(FILES ${PROJECT_BINARY_DIR}/cmake/native ${PROJECT_SOURCE_DIR}/bindings/serve/page.html
  DESTINATION ${deform_python_dir} COMPONENT python_package EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME deform)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "the founders of deform <deform@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "soft bodies that touch each other with true friction")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_OUTPUT_FILE_PREFIX ${CPACK_PACKAGE_DIRECTORY})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_GENERATE_SHLIBS ON)

set(CPACK_COMPONENTS_ALL "")
# The words after `depends` are the components of the install rules that the package holds.
function(deform_package group name summary depends)
  string(TOUPPER ${group} upper)
  foreach(component IN LISTS ARGN)
    string(TOUPPER ${component} of)
    set(CPACK_COMPONENT_${of}_GROUP ${group} PARENT_SCOPE)
    list(APPEND CPACK_COMPONENTS_ALL ${component})
  endforeach()
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_DESCRIPTION ${summary} PARENT_SCOPE)
  set(CPACK_COMPONENT_GROUP_${upper}_DESCRIPTION ${summary} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS ${depends} PARENT_SCOPE)
endfunction()
set(same "(= ${PROJECT_VERSION})")
deform_package(library libdeform0 "soft bodies with true friction: library and plugins" "" library)
deform_package(dev libdeform-dev "soft bodies with true friction: headers, CMake package"
  "libdeform0 ${same}" dev)
deform_package(doc libdeform-doc "soft bodies with true friction: the pages" "" doc)
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOC_PACKAGE_SECTION doc)
set(command_needs "libdeform0 ${same}")
if(TARGET deform_ode)
  string(APPEND command_needs ", libdeform-ode ${same}")
  deform_package(ode libdeform-ode "soft bodies in worlds of ODE" "libdeform0 ${same}" ode)
endif()
if(TARGET deform_bullet OR TARGET deform_bullet64)
  deform_package(bullet libdeform-bullet "soft bodies in worlds of Bullet" "libdeform0 ${same}" bullet)
  set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS libdeform-bullet)
endif()
deform_package(command deform "soft bodies with true friction: the command" "${command_needs}" command)
if(TARGET deform_serve)
  deform_package(serve deform-serve "soft bodies with true friction: a scene in a browser" "deform ${same}"
    serve)
endif()
if(TARGET deform_view)
  deform_package(view deform-view "soft bodies with true friction: the window of deform view"
    "deform ${same}, libglfw3 | libglfw3-wayland" view)
endif()
if(CMAKE_INSTALL_LIBDIR STREQUAL "lib")  # where `native` finds the library
  deform_package(python python3-deform "soft bodies with true friction: the Python package"
    "libdeform0 ${same}, libdeform-dev ${same}, deform ${same}, python3 (>= 3.9), python3-numpy"
    python python_package)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-matplotlib, python3-scipy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS python3-distributed)
endif()
if(TARGET solver_cholmod)
  deform_package(cholmod libdeform-cholmod "linear solver CHOLMOD for deform (GPL)"
    "libdeform0 ${same}" cholmod)
endif()
include(CPack)
