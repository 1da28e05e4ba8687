// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::evaluation {
namespace {

using test::expect_error;
using test::TemporaryFolder;

TEST(InformationFile, RoundTrip) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  std::vector<InformationEntry> written;
  for (int k = 0; k < 200; ++k) {
    InformationEntry entry{k, k + 2, 300};
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 6; ++column)
        entry.information(row, column) = 1e5 * normal(random);
    written.push_back(entry);
  }
  const TemporaryFolder folder;
  write_information(folder / "a.info", written);
  const std::vector<InformationEntry> read = read_information(folder / "a.info");
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t k = 0; k < read.size(); ++k) {
    EXPECT_EQ(read[k].i, written[k].i);
    EXPECT_EQ(read[k].j, written[k].j);
    EXPECT_EQ(read[k].count, written[k].count);
    // Half a unit of the eighth decimal.
    EXPECT_LE((read[k].information - written[k].information).cwiseAbs().maxCoeff(), 0.51e-8);
  }
}

TEST(InformationFile, HugeNumbersAreWrittenInFull) {
  const TemporaryFolder folder;
  InformationEntry entry{0, 2, 3};
  entry.information(5, 5) = 1.5e300;
  write_information(folder / "a.info", {entry});
  EXPECT_EQ(read_information(folder / "a.info").at(0).information(5, 5), 1.5e300);
}

TEST(InformationFile, NamesFileAndLineOfMalformedBlocks) {
  const TemporaryFolder folder;
  const std::string row = "1 0 0 0 0 0\n";
  const std::string path = folder.write("bad.info", "0 1 57\n" + row + row + row + row + row);
  expect_error<IoError>([&] { read_information(path); }, {path + ":6:", "ends before row 6"});
  folder.write("bad.info", "0 1 57\n" + row + "1 0 0 0\n");
  expect_error<IoError>([&] { read_information(path); },
                        {path + ":3:", "has 4 fields, expected 6"});
  folder.write("bad.info", "0 1 57\n" + row + "1 0 0 0 0 inf\n");
  expect_error<IoError>([&] { read_information(path); }, {path + ":3:", "finite"});
}

TEST(InformationFile, RefusesToWriteNaN) {
  const TemporaryFolder folder;
  InformationEntry entry{0, 2, 3};
  entry.information(2, 4) = std::nan("");
  expect_error<InvalidArgument>([&] { write_information(folder / "a.info", {entry}); },
                                {"information(2, 4)", "nan"});
}

}  // namespace
}  // namespace gpureg::evaluation
