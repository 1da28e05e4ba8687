// SPDX-License-Identifier: BSD-3-Clause
#include "fields/describe.hpp"

#include <array>
#include <charconv>

#include "fields/audit.hpp"
#include "fields/evidence.hpp"
#include "fields/find.hpp"
#include "fields/localization.hpp"
#include "fields/loop_closure.hpp"
#include "fields/statistics.hpp"

namespace gpureg::fields {
namespace {

template <typename Number>
std::string shortest(Number value) {
  char text[64] = {};
  std::to_chars(text, text + sizeof(text) - 1, value);
  return text;
}

template <typename M>
std::string type_of() {
  if constexpr (is_described<M>)
    return Fields<M>::kName;
  else if constexpr (std::is_enum_v<M>) {
    std::string names;
    for (const M value : Values<M>::kAll)
      names += (names.empty() ? "\"" : ", \"") + std::string(to_string(value)) + "\"";
    return "Literal[" + names + "]";
  } else if constexpr (std::is_same_v<M, std::array<double, 6>>)
    return "list[float]";
  else if constexpr (std::is_same_v<M, std::string>)
    return "str";
  else if constexpr (std::is_same_v<M, bool>)
    return "bool";
  else
    return std::is_floating_point_v<M> ? "float" : "int";
}

template <typename M>
std::string value_of(const M& value) {
  if constexpr (std::is_same_v<M, std::string>)
    return value.empty() ? "none" : value;
  else if constexpr (std::is_same_v<M, bool>)
    return value ? "true" : "false";
  else if constexpr (std::is_enum_v<M>)
    return to_string(value);
  else if constexpr (std::is_arithmetic_v<M>)
    return shortest(value);
  else
    return "";
}

template <typename M>
std::string range_of(const Range& range) {
  if constexpr (std::is_enum_v<M>)
    return names_of<M>("`");
  else
    return described(range);
}

template <typename T, typename = void>
constexpr bool is_options = false;
template <typename T>
constexpr bool is_options<T, std::void_t<decltype(Fields<T>::kGroup)>> = true;

template <typename T>
StructText text_of() {
  StructText out{Fields<T>::kName, Fields<T>::kSentence, is_options<T>, {}};
  const T object{};
  each<T>([&](const std::string& name, auto member, const Field& field) {
    using M = std::decay_t<decltype(object.*member)>;
    out.fields.push_back(
        {name, field.sentence, type_of<M>(), value_of(object.*member), range_of<M>(field.range)});
  });
  return out;
}

template <typename... T>
std::vector<StructText> texts() {
  return {text_of<T>()...};
}

}  // namespace

std::vector<StructText> all_structs() {
  return texts<RegistrationOptions, PrepareOptions, ConfidenceCalibration, LoopConsistencyOptions,
               pose_graph::Options, pose_graph::GncOptions, pose_graph::LineProcessOptions,
               pose_graph::DriftOptions, pose_graph::LoopNoiseOptions, pose_graph::SolverOptions,
               reconstruction::Options, reconstruction::EdgeNoiseOptions,
               reconstruction::RefineOptions, reconstruction::AuditOptions, loop_closure::Options,
               loop_closure::ProposalOptions, loop_closure::AcceptanceOptions,
               localization::MapOptions, localization::LocateOptions, localization::ChangeOptions,
               localization::FindOptions, localization::PartEvidence, PoseEvidence,
               RegistrationStatistics, StageTimings, PrepareStatistics, PairConsistency>();
}

}  // namespace gpureg::fields
