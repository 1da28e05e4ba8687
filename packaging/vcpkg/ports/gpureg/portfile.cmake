# An overlay port of this checkout: vcpkg install gpureg --overlay-ports=packaging/vcpkg/ports
# In a registry, SOURCE_PATH comes from vcpkg_from_github of a tag.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS features
  FEATURES
    tools GPUREG_BUILD_APPS)
set(cuda OFF)
if("cuda" IN_LIST FEATURES)
  set(cuda ON)
endif()

vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    ${features}
    -DGPUREG_CUDA=${cuda}
    -DGPUREG_BUILD_TESTS=OFF
    -DGPUREG_BUILD_GOLDEN=OFF
    -DGPUREG_BUILD_BENCHMARKS=OFF
    -DCMAKE_DISABLE_FIND_PACKAGE_PCL=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_embree=ON
    -DCMAKE_DISABLE_FIND_PACKAGE_assimp=ON
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/gpureg)
if("tools" IN_LIST FEATURES)
  vcpkg_copy_tools(TOOL_NAMES gpureg AUTO_CLEAN)
endif()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
