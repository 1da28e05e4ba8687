// SPDX-License-Identifier: BSD-3-Clause
// Private: bench/accuracy/fit_confidence.py gets the features of its regressions from the library.
#include "confidence/confidence.hpp"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "bindings.hpp"
#include "confidence/features.hpp"
#include "fields/evidence.hpp"
#include "settings/resolve.hpp"

namespace gpureg::python {
namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// One key of the evidence in a result's JSON: an array with a row per mode.
class Column {
 public:
  Column(const py::dict& evidence, const char* key, py::ssize_t width) : key_(key) {
    if (!evidence.contains(key))
      throw py::value_error("evidence has no '" + key_ + "', as the gpureg of today writes it");
    values_ = Numbers::ensure(evidence[key]);
    if (!values_) throw py::error_already_set();
    const bool fits =
        width == 1 ? values_.ndim() == 1 : values_.ndim() == 2 && values_.shape(1) == width;
    if (!fits)
      throw py::value_error("evidence['" + key_ + "']: expected " + std::to_string(width) +
                            " numbers per mode");
    width_ = width;
  }
  py::ssize_t size() const { return values_.shape(0); }
  const std::string& key() const { return key_; }
  const double* row(py::ssize_t mode) const { return values_.data() + mode * width_; }

 private:
  std::string key_;
  Numbers values_;
  py::ssize_t width_ = 1;
};

/// Reads each described field of the evidence. No feature depends on those of kUnused: records may
/// lack them.
class EvidenceReader {
 public:
  explicit EvidenceReader(const py::dict& evidence)
      : evidence_(evidence),
        out_(static_cast<std::size_t>(Column(evidence, "match_inliers", 1).size())) {}

  template <typename M>
  void operator()(M PoseEvidence::* member, const fields::Field& field) {
    constexpr py::ssize_t width = std::is_class_v<M> ? 6 : 1;
    each(field.name, width, [&](PoseEvidence& e, const double* row) {
      if constexpr (std::is_class_v<M>)
        std::copy_n(row, width, (e.*member).begin());
      else
        e.*member = static_cast<M>(*row);
    });
  }
  template <typename M>
  void operator()(M PoseEvidence::* source, M PoseEvidence::* target, const fields::Field& field) {
    each(field.name, 2, [&](PoseEvidence& e, const double* row) {
      e.*source = row[0];
      e.*target = row[1];
    });
  }
  const std::vector<PoseEvidence>& modes() const { return out_; }

 private:
  static constexpr std::string_view kUnused[] = {"residual", "weakest_direction"};

  template <typename Assign>
  void each(const char* key, py::ssize_t width, Assign&& assign) {
    if (std::count(std::begin(kUnused), std::end(kUnused), key) > 0 && !evidence_.contains(key))
      return;
    const Column column(evidence_, key, width);
    if (column.size() != static_cast<py::ssize_t>(out_.size()))
      throw py::value_error("evidence['" + column.key() + "']: expected as many rows as modes");
    for (py::ssize_t k = 0; k < column.size(); ++k)
      assign(out_[static_cast<std::size_t>(k)], column.row(k));
  }

  const py::dict& evidence_;
  std::vector<PoseEvidence> out_;
};

std::vector<PoseEvidence> evidence_from(const py::dict& evidence) {
  EvidenceReader reader(evidence);
  fields::Fields<PoseEvidence>::visit(reader);
  return reader.modes();
}

Numbers table(std::size_t rows) { return Numbers({rows, confidence::kFeatureCount}); }

void write(const confidence::Features& features, std::size_t row, Numbers& out) {
  std::copy(features.begin(), features.end(), out.mutable_data(row, 0));
}

std::vector<std::string> feature_names() {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < confidence::kFeatureCount; ++k)
    out.emplace_back(confidence::to_string(static_cast<confidence::Feature>(k)));
  return out;
}

Numbers features(const py::dict& evidence, bool free_space, bool surface_sides, bool model,
                 const std::string& regressand) {
  if (regressand != "ranking" && regressand != "confidence")
    throw py::value_error("regressand: expected 'ranking' or 'confidence', got '" + regressand +
                          "'");
  const std::vector<PoseEvidence> modes = evidence_from(evidence);
  Numbers out = table(modes.size());
  for (std::size_t k = 0; k < modes.size(); ++k)
    write(confidence::features_of(modes[k], {free_space, surface_sides, model},
                                  regressand == "ranking" ? confidence::Regressand::ranking
                                                          : confidence::Regressand::confidence),
          k, out);
  return out;
}

Numbers rank_features(const std::vector<double>& log_odds, const Numbers& own,
                      const std::vector<std::size_t>& modes_per_pair, std::uint32_t refined) {
  if (own.ndim() != 2 || own.shape(0) != static_cast<py::ssize_t>(log_odds.size()) ||
      own.shape(1) != static_cast<py::ssize_t>(confidence::kFeatureCount))
    throw py::value_error("own: expected the features of each of log_odds");
  Numbers out = table(log_odds.size());
  std::size_t first = 0;
  for (const std::size_t count : modes_per_pair) {
    if (count > log_odds.size() - first)
      throw py::value_error("modes_per_pair: more modes than log_odds");
    const auto begin = log_odds.begin() + static_cast<std::ptrdiff_t>(first);
    const std::vector<double> of_pair(begin, begin + static_cast<std::ptrdiff_t>(count));
    std::vector<confidence::Features> own_of_pair(count);
    for (std::size_t k = 0; k < count; ++k)
      std::copy_n(own.data(static_cast<py::ssize_t>(first + k), 0), confidence::kFeatureCount,
                  own_of_pair[k].begin());
    for (std::size_t k = 0; k < count; ++k) {
      confidence::Features row{};
      confidence::add_rank(of_pair, own_of_pair, k, refined, row);
      write(row, first + k, out);
    }
    first += count;
  }
  if (first != log_odds.size()) throw py::value_error("modes_per_pair: fewer modes than log_odds");
  return out;
}

}  // namespace

void bind_confidence(py::module_& m) {
  using namespace py::literals;
  m.def("_confidence_feature_names", &feature_names,
        "Names of the features of the confidence, in the order of the columns.");
  m.def("_confidence_features", &features, "evidence"_a, "free_space"_a, "surface_sides"_a,
        "model"_a, "regressand"_a,
        "(modes, features): of modes by their own evidence. evidence: the keys of a result's JSON, "
        "each an array with a row per mode.");
  m.def("_confidence_rank_features", &rank_features, "log_odds"_a, "own"_a, "modes_per_pair"_a,
        "refined"_a,
        "(modes, features): of modes among the others of their pair, 0 elsewhere. own: from "
        "_confidence_features. refined: from _refined_modes.");
  m.def(
      "_refined_modes",
      [](const RegistrationOptions& options) { return resolve(options).evidence.modes; },
      "options"_a, "Modes of a pair that are refined and ranked.");
  m.def(
      "_confidence_factor", py::vectorize([](std::uint32_t points, std::uint32_t of) {
        return confidence::factor_of({points, of});
      }),
      "points"_a, "of"_a,
      "Factor on the confidence where few points overlap. points: of the side with fewer of them; "
      "of: points of that side.");
}

}  // namespace gpureg::python
