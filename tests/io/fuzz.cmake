# SPDX-License-Identifier: BSD-3-Clause
# gpureg_fuzz_io --seconds 60 [--seed N]: deterministic mutations, any compiler.
# gpureg_libfuzzer_io -max_total_time=60 [CORPUS]: guided by coverage, clang only.
# The readers are compiled once more, so that they are instrumented whatever the rest of the build is.
set(_fuzz_sources fuzz_read_point_cloud.cpp)
foreach(_target gpureg_files gpureg_io gpureg_evaluation)
  get_target_property(_folder ${_target} SOURCE_DIR)
  get_target_property(_files ${_target} SOURCES)
  list(TRANSFORM _files PREPEND ${_folder}/)
  list(APPEND _fuzz_sources ${_files})
endforeach()

function(_add_fuzzer name sanitizers)
  add_executable(${name} ${ARGN} ${_fuzz_sources})
  gpureg_target(${name})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE Eigen3::Eigen)
  target_compile_options(${name} PRIVATE -g -fsanitize=${sanitizers} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(${name} PRIVATE -fsanitize=${sanitizers})
endfunction()

_add_fuzzer(gpureg_fuzz_io address,undefined fuzz_loop.cpp)
if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  _add_fuzzer(gpureg_libfuzzer_io fuzzer,address,undefined)
else()
  message(STATUS "gpureg: without gpureg_libfuzzer_io (needs clang)")
endif()
