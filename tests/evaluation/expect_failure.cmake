# SPDX-License-Identifier: BSD-3-Clause
# PROGRAM's comparison with the published figures must fail; WHAT is wrong in it.
set(_case Published.RecallAndPrecisionToTheDigit)
execute_process(COMMAND ${PROGRAM} --gtest_filter=${_case} OUTPUT_VARIABLE _out ERROR_VARIABLE _out RESULT_VARIABLE _status)
if(_out MATCHES "SKIPPED")
  message("skipped: GPUREG_DATA_DIR does not point at the published logs")
elseif(_status EQUAL 0 OR NOT _out MATCHES "FAILED  . ${_case}")
  message(FATAL_ERROR "not noticed: ${WHAT} (exit status ${_status})\n${_out}")
else()
  string(REGEX MATCH "Which is: \"[^\"]*\"" _figure "${_out}")
  message("noticed: ${WHAT}; CZK, recall / precision: ${_figure}")
endif()
