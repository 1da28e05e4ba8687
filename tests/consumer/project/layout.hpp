// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gpureg/evaluation.hpp>
#include <gpureg/gpureg.hpp>
#include <gpureg/io.hpp>

#include <cstddef>
#include <sstream>
#include <string>

/// Size and alignment of every public type, and where its members lie, as the including file's
/// flags make them.
inline std::string layout() {
  std::ostringstream out;
#define TYPE(type) \
  out << #type << " " << sizeof(gpureg::type) << " " << alignof(gpureg::type) << "\n"
#define MEMBER(type, member) \
  out << #type "::" #member << " " << offsetof(gpureg::type, member) << "\n"
  TYPE(PointCloudView);
  TYPE(PointCloud);
  TYPE(PrepareOptions);
  TYPE(RegistrationOptions);
  MEMBER(RegistrationOptions, quadruples);
  MEMBER(RegistrationOptions, method);
  MEMBER(RegistrationOptions, prepare);
  TYPE(Context);
  TYPE(PreparedCloud);
  TYPE(Correspondence);
  TYPE(Pair);
  TYPE(BatchCallbacks);
  TYPE(RegistrationStatistics);
  TYPE(StageTimings);
  TYPE(PrepareStatistics);
  TYPE(CorrespondenceMoments);
  MEMBER(CorrespondenceMoments, outer);
  TYPE(RegistrationResult);
  MEMBER(RegistrationResult, target_from_source);
  MEMBER(RegistrationResult, confidence);
  MEMBER(RegistrationResult, source_moments);
  MEMBER(RegistrationResult, target_moments);
  MEMBER(RegistrationResult, statistics);
  MEMBER(RegistrationResult, timings);
  TYPE(evaluation::LogEntry);
  MEMBER(evaluation::LogEntry, transform);
  TYPE(evaluation::InformationEntry);
  MEMBER(evaluation::InformationEntry, information);
  TYPE(evaluation::Report);
  MEMBER(evaluation::Report, confidence);
  TYPE(evaluation::GroundTruth);
  TYPE(evaluation::Evaluation);
#undef TYPE
#undef MEMBER
  return out.str();
}
