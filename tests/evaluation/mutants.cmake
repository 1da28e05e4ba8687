# SPDX-License-Identifier: BSD-3-Clause
# The published figures must notice every tempting mistake in the protocol: src/evaluation/redwood.cpp is compiled once more with each of
# them, and the test that compares with the figures has to fail.
add_library(gpureg_published_test OBJECT published_test.cpp)
gpureg_target(gpureg_published_test)
target_include_directories(gpureg_published_test PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/tests)
target_link_libraries(gpureg_published_test PRIVATE gpureg::evaluation GTest::gtest)

# add_mutant(name what right wrong): what: in words; right: a text of redwood.cpp; wrong: what stands there instead.
function(add_mutant name what right wrong)
  set(_source ${PROJECT_SOURCE_DIR}/src/evaluation/redwood.cpp)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${_source})
  file(READ ${_source} _text)
  string(FIND "${_text}" "${right}" _at)
  if(_at EQUAL -1)
    message(FATAL_ERROR "tests/evaluation/mutants.cmake: redwood.cpp no longer holds '${right}' (mutant ${name})")
  endif()
  string(REPLACE "${right}" "${wrong}" _text "${_text}")
  file(CONFIGURE OUTPUT mutants/${name}.cpp CONTENT "${_text}" @ONLY)
  set(_target gpureg_evaluation_mutant_${name})
  # The mutant's own functions come before those of the library.
  add_executable(${_target} ${CMAKE_CURRENT_BINARY_DIR}/mutants/${name}.cpp $<TARGET_OBJECTS:gpureg_published_test>)
  gpureg_target(${_target})
  target_include_directories(${_target} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${_target} PRIVATE gpureg::evaluation GTest::gtest GTest::gtest_main)
  add_test(NAME gpureg_evaluation_mutant.${name}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${_target}> "-DWHAT=${what}" -P ${CMAKE_CURRENT_SOURCE_DIR}/expect_failure.cmake)
  set_tests_properties(gpureg_evaluation_mutant.${name} PROPERTIES SKIP_REGULAR_EXPRESSION "skipped: ")
endfunction()

add_mutant(quaternion_sign "the opposite sign of the quaternion" "q.vec();" "-q.vec();")
add_mutant(consecutive "consecutive pairs counted" "namespace gpureg::evaluation {\nnamespace {\n"
  "#define counts(i, j) (static_cast<long long>(j) - (i) > 0)\nnamespace gpureg::evaluation {\nnamespace {\n")
add_mutant(pooled "a pooled instead of a scene mean" "  if (scenes.empty()) return mean;\n"
  "  if (scenes.empty()) return mean;\n  Scores pool;\n  for (const Scores& s : scenes) {\n    pool.good += s.good, pool.good_recall += s.good_recall;\n    pool.ground_truth += s.ground_truth, pool.reported += s.reported;\n  }\n  if (pool.ground_truth > 0) return {pool.recall(), pool.precision()};\n")
add_mutant(open3d_order "Open3D's order of the information matrix" "e.topRightCorner<3, 1>(), q.vec()" "q.vec(), e.topRightCorner<3, 1>()")
