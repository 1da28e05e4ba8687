// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

// CLI11 takes five seconds to compile: command_line.cpp alone includes it.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace gpureg::cli {

/// What a verb does after parsing; returns the exit status.
using Action = std::function<int()>;

/// Option of a verb, to be described further.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option& required();
  Option& show_default();  ///< the help shows the present value
  Option& show_default(const std::string& text);
  Option& type_name(const std::string& text);
  Option& one_of(const std::vector<std::string>& words);
  /// Of unsigned numbers: refuses a sign, which CLI11 wraps around. zero: what 0 stands for.
  Option& natural(const std::string& zero = "");
  Option& between(double low, double high);
  Option& between(unsigned low, unsigned high);
  Option& not_negative();
  Option& positive();
  Option& one_at_a_time();  ///< of vectors: --name a --name b, so that a positional may follow
  Option& needs(const Option& other);
  Option& excludes(const Option& other);

 private:
  CLI::Option* option_;
};

/// Verb of the command line, as "batch". A handle.
class Verb {
 public:
  Verb(CLI::App* app, Action* chosen) : app_(app), chosen_(chosen) {}

  /// Value: text, a number, an optional number, or a vector of texts.
  /// @param names as "-o,--output", or "DIR" of a positional.
  template <typename Value>
  Option option(const std::string& names, Value& value, const std::string& help);
  Option flag(const std::string& names, bool& value, const std::string& help);
  /// Option whose text the verb reads: take returns false where it cannot.
  Option text(const std::string& name, std::function<bool(const std::string&)> take,
              const std::string& help);
  /// Option of an enumeration, by words.
  template <typename Enum>
  Option choice(const std::string& name, Enum& value, const std::map<std::string, Enum>& words,
                const std::string& help) {
    std::map<std::string, int> numbers;
    for (const auto& [word, item] : words) numbers[word] = static_cast<int>(item);
    return choice(name, [&value](int k) { value = static_cast<Enum>(k); }, numbers, help);
  }
  /// Text under the options, above that of every verb.
  void notes(const std::string& text);
  /// What runs where the command line names the verb.
  void run(Action action);
  /// Whether the user gave the option, as "--quality".
  bool given(const std::string& option) const;

 private:
  Option choice(const std::string& name, std::function<void(int)> take,
                const std::map<std::string, int>& words, const std::string& help);

  CLI::App* app_;
  Action* chosen_;
};

/// The verbs of a program.
class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& description,
              const std::string& version);
  ~CommandLine();

  Verb verb(const std::string& name, const std::string& help);
  /// Verb of another program, which reads its own arguments: become gets all of argv.
  void program(const std::string& name, const std::string& help, void (*become)(char** argv));
  /// Parses, then runs the chosen verb, or prints the help or the version.
  /// @return exit status. @throws InvalidArgument naming what is wrong with the arguments.
  int run(int argc, char** argv);

 private:
  std::unique_ptr<CLI::App> app_;
  std::map<std::string, void (*)(char**)> programs_;
  Action chosen_;
};

/// Reads a number; false where text is more or less than one.
bool read_number(const std::string& text, float& number);
bool read_number(const std::string& text, double& number);

}  // namespace gpureg::cli
