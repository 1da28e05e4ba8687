// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace gpureg::test {

/// Runs action, which must throw ErrorType with every one of the fragments in its message.
template <typename ErrorType, typename Action>
void expect_error(Action&& action, std::initializer_list<std::string> fragments) {
  try {
    action();
  } catch (const ErrorType& error) {
    for (const std::string& fragment : fragments)
      EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos)
          << "message: " << error.what() << "\nlacks: " << fragment;
    return;
  } catch (const std::exception& error) {
    ADD_FAILURE() << "wrong type of exception: " << error.what();
    return;
  }
  ADD_FAILURE() << "no exception";
}

}  // namespace gpureg::test
