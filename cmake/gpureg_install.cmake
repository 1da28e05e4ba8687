# SPDX-License-Identifier: BSD-3-Clause
include(CMakePackageConfigHelpers)
set(_gpureg_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gpureg)
install(DIRECTORY include/gpureg DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT gpureg-targets NAMESPACE gpureg:: DESTINATION ${_gpureg_cmake_dir})
if(TARGET gpureg_io)
  install(EXPORT gpureg-io-targets NAMESPACE gpureg:: DESTINATION ${_gpureg_cmake_dir})
endif()
configure_package_config_file(cmake/gpureg-config.cmake.in ${PROJECT_BINARY_DIR}/gpureg-config.cmake
  INSTALL_DESTINATION ${_gpureg_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/gpureg-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/gpureg-config.cmake ${PROJECT_BINARY_DIR}/gpureg-config-version.cmake
  DESTINATION ${_gpureg_cmake_dir})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
