// SPDX-License-Identifier: BSD-3-Clause
#include "json/fields_json.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>

#include "fields/evidence.hpp"
#include "fields/find.hpp"
#include "fields/options.hpp"
#include "fields/statistics.hpp"
#include "gpureg/error.hpp"
#include "json/json.hpp"

namespace gpureg::cli {
namespace {

double shortest(float value) {
  char text[64] = {};
  std::to_chars(text, text + sizeof(text) - 1, value);
  return std::strtod(text, nullptr);
}

template <typename T>
struct Writer {
  const T& object;
  Json& json;
  bool milliseconds_only = false, others_only = false;

  template <typename M>
  void operator()(M T::* member, const fields::Field& field) {
    if (skipped(field)) return;
    if constexpr (fields::is_described<M>) {
      Json group;
      fields::Fields<M>::visit(Writer<M>{object.*member, group});
      json[field.name] = std::move(group);
    } else if constexpr (std::is_same_v<M, float>)
      json[field.name] = shortest(object.*member);
    else if constexpr (std::is_enum_v<M>)
      json[field.name] = to_string(object.*member);
    else
      json[field.name] = object.*member;
  }
  template <typename M>
  void operator()(M T::* source, M T::* target, const fields::Field& field) {
    json[field.name] = {object.*source, object.*target};
  }

 private:
  bool skipped(const fields::Field& field) const {
    const bool time = field.range.unit == fields::kMilliseconds.unit;
    return (milliseconds_only && !time) || (others_only && time);
  }
};

template <typename T>
Json written(const T& object) {
  Json json;
  fields::Fields<T>::visit(Writer<T>{object, json});
  return json;
}

[[noreturn]] void refuse(const char* name, const Json& value, const char* expected) {
  throw InvalidArgument(std::string("\"") + name + "\" holds " + value.dump() + ", expected " +
                        expected);
}

void read(const Json& value, const char* name, double& out) {
  // Infinity and NaN cannot be written in JSON, but 1e999 can be read.
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    refuse(name, value, "a finite number");
  out = value.get<double>();
}

void read(const Json& value, const char* name, bool& out) {
  if (!value.is_boolean()) refuse(name, value, "true or false");
  out = value.get<bool>();
}

template <typename Count>
void read_count(const Json& value, const char* name, Count& out) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<Count>::max())
    refuse(name, value, "a whole number, 0 or more");
  out = value.get<Count>();
}
void read(const Json& value, const char* name, std::uint32_t& out) { read_count(value, name, out); }
void read(const Json& value, const char* name, std::uint64_t& out) { read_count(value, name, out); }

void read(const Json& value, const char* name, std::array<double, 6>& out) {
  if (!value.is_array() || value.size() != out.size())
    throw InvalidArgument(std::string("\"") + name + "\" is not an array of 6 numbers");
  for (std::size_t k = 0; k < out.size(); ++k) read(value[k], name, out[k]);
}

template <typename T>
struct Reader {
  const Json& json;
  T& object;

  template <typename M>
  void operator()(M T::* member, const fields::Field& field) {
    if (const auto found = json.find(field.name); found != json.end())
      read(*found, field.name, object.*member);
  }
  template <typename M>
  void operator()(M T::* source, M T::* target, const fields::Field& field) {
    const auto found = json.find(field.name);
    if (found == json.end()) return;
    if (!found->is_array() || found->size() != 2)
      throw InvalidArgument(std::string("\"") + field.name + "\" is not an array of 2 numbers");
    read((*found)[0], field.name, object.*source);
    read((*found)[1], field.name, object.*target);
  }
};

}  // namespace

Json to_json(const RegistrationOptions& options) { return written(options); }
Json to_json(const RegistrationStatistics& statistics) { return written(statistics); }
Json to_json(const PoseEvidence& evidence) { return written(evidence); }
Json to_json(const localization::PartEvidence& evidence) { return written(evidence); }

Json to_json(const StageTimings& timings) {
  Json json = written(timings);
  json["total"] = timings.total();
  return json;
}

Json to_json(const PrepareStatistics& prepare) {
  Json json, milliseconds;
  fields::Fields<PrepareStatistics>::visit(Writer<PrepareStatistics>{prepare, json, false, true});
  fields::Fields<PrepareStatistics>::visit(Writer<PrepareStatistics>{prepare, milliseconds, true});
  milliseconds["total"] = prepare.total();
  json["ms"] = std::move(milliseconds);
  return json;
}

void read_json(const Json& json, PoseEvidence& evidence) {
  fields::Fields<PoseEvidence>::visit(Reader<PoseEvidence>{json, evidence});
}
void read_json(const Json& json, RegistrationStatistics& statistics) {
  fields::Fields<RegistrationStatistics>::visit(Reader<RegistrationStatistics>{json, statistics});
}
void read_json(const Json& json, StageTimings& timings) {
  fields::Fields<StageTimings>::visit(Reader<StageTimings>{json, timings});
}

}  // namespace gpureg::cli
