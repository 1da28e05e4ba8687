// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "bindings.hpp"
#include "gpureg/sets/register_all.hpp"
#include "teller.hpp"

namespace gpureg::python {

/// A FragmentSet of Python. Any thread may use it, without Python's lock.
class PythonSet : public FragmentSet {
 public:
  /// load(k, RegistrationOptions): the tuple of an Input on the host; OSError where there is none.
  PythonSet(std::vector<std::string> names, std::vector<std::string> fingerprints, py::object load)
      : names_(std::move(names)), fingerprints_(std::move(fingerprints)), load_(std::move(load)) {}

  std::size_t size() const override { return names_.size(); }
  std::string name(std::size_t k) const override { return names_[k]; }
  std::string label(std::size_t k) const override { return "fragments[" + std::to_string(k) + "]"; }
  std::string fingerprint(std::size_t k) const override { return fingerprints_.at(k); }
  LoadedCloud read(std::size_t k, const RegistrationOptions& options) const override;

 private:
  std::vector<std::string> names_, fingerprints_;
  py::object load_;
};

/// What Python calls a PairJournal. Closed at the end of a run, whoever still holds it.
struct Journal {
  std::unique_ptr<PairJournal> journal;

  PairJournal& get() const {
    if (!journal) throw py::value_error("the journal is closed");
    return *journal;
  }
};

/// (M, 2) uint32 rows (source, target).
std::vector<Pair> pairs_of(const py::array_t<std::uint32_t, py::array::c_style>& rows);

/// {fragment: reason}
py::dict dict_of(const std::map<std::size_t, std::string>& unusable);

}  // namespace gpureg::python
