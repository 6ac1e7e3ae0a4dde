# An overlay port: it builds the tree that it lies in.
#   vcpkg install deform --overlay-ports=cmake/packaging/vcpkg
# Debug and release trees have plugins of their own, in lib/deform/plugins-N beside each library; an archive
# has them inside.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../../.." ABSOLUTE)
vcpkg_check_features(OUT_FEATURE_OPTIONS features FEATURES tools DEFORM_CLI)
string(COMPARE EQUAL "${VCPKG_LIBRARY_LINKAGE}" "dynamic" shared)
string(COMPARE EQUAL "${VCPKG_LIBRARY_LINKAGE}" "static" inside)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS ${features} -DDEFORM_SHARED=${shared} -DDEFORM_PLUGINS_STATIC=${inside} -DDEFORM_TESTS=OFF
    -DDEFORM_EXAMPLES=OFF -DDEFORM_RENDER=OFF -DDEFORM_VIEW=OFF -DDEFORM_ODE=OFF -DDEFORM_BULLET=OFF
    -DDEFORM_ASSIMP=OFF)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/deform)
vcpkg_fixup_pkgconfig()
if("tools" IN_LIST FEATURES)
  vcpkg_copy_tools(TOOL_NAMES deform AUTO_CLEAN)
endif()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share"
  "${CURRENT_PACKAGES_DIR}/share/doc")
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
