// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <utility>

#include "gpureg/error.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

// CLI11 takes -4 for an unsigned number and wraps it around.
std::string check_natural(const std::string& text, const std::string& zero) {
  if (text.empty() || text.find_first_not_of("0123456789") != std::string::npos)
    return "'" + text + "', expected a whole number, 0 or more" +
           (zero.empty() ? "" : " (0: " + zero + ")");
  errno = 0;
  std::strtoull(text.c_str(), nullptr, 10);
  return errno == 0 ? "" : text + " is too large";
}

std::vector<std::string> verbs_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands(nullptr)) names.push_back(verb->get_name());
  return names;
}

std::vector<std::string> options_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& words) {
  const std::string meant = nearest(word, words);
  return meant.empty() ? "" : ", did you mean " + meant + "?";
}

std::string joined(const std::vector<std::string>& words) {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  return list;
}

/// By one argument; of a pattern without quotes, the shell makes many.
bool takes_scans(const std::string& verb) {
  return verb == "batch" || verb == "reconstruct" || verb == "calibrate" || verb == "audit";
}

// CLI11's own words for a misspelt verb or option do not always name it.
std::string what_is_wrong(const CLI::App& app, const CLI::ParseError& error, int argc,
                          char** argv) {
  const auto chosen = app.get_subcommands();
  if (chosen.empty()) {
    const std::string first = argc > 1 ? argv[1] : "";
    const std::vector<std::string> verbs = verbs_of(app);
    return (first.empty() ? std::string("no verb given")
                          : "there is no verb " + first + did_you_mean(first, verbs)) +
           "; verbs: " + joined(verbs) + " (see `gpureg --help`)";
  }
  const std::string help = " (see `gpureg " + chosen.front()->get_name() + " --help`)";
  const std::vector<std::string> unknown = app.remaining(true);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr || unknown.empty())
    return error.what() + help;
  const auto option = std::find_if(unknown.begin(), unknown.end(),
                                   [](const std::string& text) { return text.rfind("-", 0) == 0; });
  if (option != unknown.end())
    return "unknown option " + *option +
           did_you_mean(option->substr(0, option->find('=')), options_of(*chosen.front())) + help;
  return "unexpected argument " + unknown.front() +
         (takes_scans(chosen.front()->get_name()) && ::access(unknown.front().c_str(), F_OK) == 0
              ? ": several scans are a folder, a list, or a pattern in quotes, 'scans/*.ply'"
              : "") +
         help;
}

}  // namespace

Option& Option::required() {
  option_->required();
  return *this;
}

Option& Option::show_default() {
  option_->capture_default_str();
  return *this;
}

Option& Option::show_default(const std::string& text) {
  option_->default_str(text);
  return *this;
}

Option& Option::type_name(const std::string& text) {
  option_->type_name(text);
  return *this;
}

Option& Option::one_of(const std::vector<std::string>& words) {
  option_->check(CLI::IsMember(words));
  return *this;
}

Option& Option::natural(const std::string& zero) {
  option_->check(CLI::Validator(
      [zero](const std::string& text) { return check_natural(text, zero); }, "", "natural number"));
  return *this;
}

Option& Option::between(double low, double high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option& Option::between(unsigned low, unsigned high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option& Option::not_negative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

Option& Option::positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

Option& Option::one_at_a_time() {
  option_->allow_extra_args(false);
  return *this;
}

Option& Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Option& Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

template <typename Value>
Option Verb::option(const std::string& names, Value& value, const std::string& help) {
  return Option(app_->add_option(names, value, help));
}

template Option Verb::option(const std::string&, std::string&, const std::string&);
template Option Verb::option(const std::string&, std::vector<std::string>&, const std::string&);
template Option Verb::option(const std::string&, int&, const std::string&);
template Option Verb::option(const std::string&, std::uint32_t&, const std::string&);
template Option Verb::option(const std::string&, std::uint64_t&, const std::string&);
template Option Verb::option(const std::string&, float&, const std::string&);
template Option Verb::option(const std::string&, double&, const std::string&);
template Option Verb::option(const std::string&, std::optional<float>&, const std::string&);
template Option Verb::option(const std::string&, std::optional<double>&, const std::string&);

Option Verb::flag(const std::string& names, bool& value, const std::string& help) {
  return Option(app_->add_flag(names, value, help));
}

Option Verb::text(const std::string& name, std::function<bool(const std::string&)> take,
                  const std::string& help) {
  const auto read = [name, take = std::move(take), app = app_](const std::string& text) {
    if (!take(text))
      throw CLI::ValidationError(
          name, "'" + text + "', expected " + app->get_option(name)->get_type_name());
  };
  return Option(app_->add_option_function<std::string>(name, read, help));
}

Option Verb::choice(const std::string& name, std::function<void(int)> take,
                    const std::map<std::string, int>& words, const std::string& help) {
  return Option(
      app_->add_option_function<int>(name, take, help)->transform(CLI::CheckedTransformer(words)));
}

void Verb::notes(const std::string& text) { app_->footer(text + app_->get_footer()); }

void Verb::run(Action action) {
  app_->callback([chosen = chosen_, action = std::move(action)] { *chosen = action; });
}

bool Verb::given(const std::string& option) const { return app_->count(option) > 0; }

CommandLine::CommandLine(const std::string& program, const std::string& description,
                         const std::string& version)
    : app_(std::make_unique<CLI::App>(description, program)) {
  app_->set_version_flag("--version", version);
  app_->require_subcommand(1);
  // Verbs take it over when they are added.
  app_->footer(
      "Exit status: 0 aligned or done, 1 no alignment found, 2 bad usage or input, 130 "
      "interrupted.");
}

CommandLine::~CommandLine() = default;

Verb CommandLine::verb(const std::string& name, const std::string& help) {
  return {app_->add_subcommand(name, help), &chosen_};
}

void CommandLine::program(const std::string& name, const std::string& help,
                          void (*become)(char** argv)) {
  app_->add_subcommand(name, help);
  programs_[name] = become;
}

int CommandLine::run(int argc, char** argv) {
  const auto program = argc > 1 ? programs_.find(argv[1]) : programs_.end();
  if (program != programs_.end()) program->second(argv);
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version come as exceptions, too.
    if (error.get_exit_code() == 0) return app_->exit(error);
    throw InvalidArgument(what_is_wrong(*app_, error, argc, argv));
  }
  return chosen_();
}

bool read_number(const std::string& text, float& number) {
  return CLI::detail::lexical_cast(text, number);
}

bool read_number(const std::string& text, double& number) {
  return CLI::detail::lexical_cast(text, number);
}

}  // namespace gpureg::cli
