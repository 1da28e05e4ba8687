// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <string_view>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/io.hpp"
#include "io/seed_files.hpp"

namespace gpureg::test {

/// A file in memory, with a path for the readers.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view content) : fd_(::memfd_create("gpureg", MFD_CLOEXEC)) {
    if (fd_ < 0 ||
        ::write(fd_, content.data(), content.size()) != static_cast<ssize_t>(content.size()))
      throw std::runtime_error("cannot make a file in memory");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(fd_); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

/// The point cloud of a file with this content.
inline PointCloud read_content(std::string_view content) {
  return io::read_point_cloud(MemoryFile(content).path());
}

/// Reads content with that reader. True: read; false: refused with an IoError that says where.
/// Anything else goes up.
inline bool run_reader(Reader reader, std::string_view content) {
  const MemoryFile file(content);
  try {
    switch (reader) {
      case Reader::point_cloud: {
        io::scans_in(file.path());
        const PointCloud cloud = io::read_point_cloud(file.path());
        if (!cloud.normals.empty() && cloud.normals.size() != cloud.points.size())
          throw std::logic_error("normals without points");
        break;
      }
      case Reader::log:
        evaluation::read_log(file.path());
        break;
      case Reader::information:
        evaluation::read_information(file.path());
        break;
      case Reader::cameras:
        io::read_cameras(file.path());
        break;
      case Reader::pairs:
        io::read_pairs(file.path());
        break;
    }
  } catch (const IoError& error) {
    if (std::string_view(error.what()).find(file.path()) == std::string_view::npos)
      throw std::logic_error("an error without its file");
    return false;
  }
  return true;
}

}  // namespace gpureg::test
