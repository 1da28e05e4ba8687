// SPDX-License-Identifier: BSD-3-Clause
// The README shows the program and the CMake lines that consumer_test.cpp builds and runs, and
// measured figures.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "command.hpp"

namespace gpureg {
namespace {

std::string read(const std::string& name) {
  std::ifstream file(CONSUMER_SOURCE "/" + name);
  EXPECT_TRUE(file) << name;
  return std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
}

TEST(Readme, ShowsTheProgramThatIsTested) {
  const std::string program = read("tests/consumer/project/register_two_clouds.cpp");
  EXPECT_NE(read("README.md").find("```cpp\n" + program.substr(program.find('\n') + 1) + "```\n"),
            std::string::npos);
}

TEST(Readme, ShowsTheCMakeLinesThatAreTested) {
  const std::string lines = read("tests/consumer/project/CMakeLists.txt");
  const std::size_t begin = lines.find("find_package("), end = lines.find("\n\n", begin);
  EXPECT_NE(read("README.md").find("```cmake\n" + lines.substr(begin, end - begin) + "\n```\n"),
            std::string::npos);
}

// No figure is typed by hand.
TEST(Readme, ShowsTheFiguresOfTheRecords) {
  if (test::run_command({"sh", "-c", "command -v python3"}).status != 0)
    GTEST_SKIP() << "python3 is not installed";
  const test::Outcome outcome =
      test::run_command({"python3", CONSUMER_SOURCE "/bench/readme_table.py", "--check"});
  EXPECT_EQ(outcome.status, 0) << outcome.output;
}

}  // namespace
}  // namespace gpureg
