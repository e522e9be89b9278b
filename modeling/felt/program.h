#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/felt/context.h"
#include "nephele/modeling/felt/diagnostic.h"
#include "nephele/modeling/felt/registry.h"
#include "nephele/modeling/felt/value.h"

/// Felt, the language of fields: scripts are read and checked once and run as often as needed.
///
/// A script builds expressions, caches and shapes; what it costs to evaluate them afterwards is what the same
/// expressions cost in C++. docs/felt.md is a tour of the language.
/// Source: Tessendorf, Resolution Independent Volumes, whose scripts run as printed.
namespace nephele::felt {

/// A name that a script finds declared, with its value.
struct Given {
  std::string name;
  Type type;
  Value value{};
  /// Makes the value of one that is dear, and is asked only where the name is read. Empty: `value` is it.
  std::function<Value()> make{};
};

/// A variable outside of functions after a run.
struct Named {
  std::string name;
  Type type;
  Value value;
  /// For fields: operations that they are made of, each counted once; 0 unless asked for.
  std::size_t operations = 0;
};

/// What a script lets others set: `param float gain = 1 in [0, 4] "what it does";`
struct ScriptParameter {
  std::string name;
  Type type;
  /// As it is if nobody sets it, in the words of the script.
  std::string standard;
  /// Lowest and highest, or all choices, in the words of the script; empty where everything goes.
  std::vector<std::string> allowed;
  /// Whether `allowed` are choices, not the ends of a range.
  bool isChoice = false;
  bool isColor = false;
  std::string text;
};

struct RunOptions {
  /// Values of parameters by name, as expressions: {"gain", "2"}.
  std::map<std::string, std::string> settings{};
  /// The given names as the program was told of them, with the values that hold now; empty: those of then.
  std::vector<Given> given{};
  /// Counts the operations of fields.
  bool countsOperations = false;
};

/// A script that has been checked.
class Program {
 public:
  /// Reads the text called `name` and the files that it imports, which are sought beside it.
  /// `registry` must outlive the program. @throws ScriptError with all faults; Error if a file cannot be
  /// read.
  Program(const std::string& name, std::string text, const Registry& registry,
          const std::vector<Given>& given = {});
  /// The script in the file at `path`. @throws as the constructor.
  static Program fromFile(const std::string& path, const Registry& registry,
                          const std::vector<Given>& given = {});
  ~Program();
  Program(Program&&) noexcept;
  Program& operator=(Program&&) noexcept;

  /// What is allowed but likely a slip.
  const std::vector<Diagnostic>& warnings() const;
  const Sources& sources() const;
  const std::vector<ScriptParameter>& parameters() const;
  /// The type of a variable outside of functions and blocks, or nothing.
  std::optional<Type> typeOf(const std::string& name) const;

  /// Runs the script and returns its variables in the order of their declarations.
  /// @throws ScriptError with the fault; Cancelled; Error if a setting is unknown.
  std::vector<Named> run(Context& context, const RunOptions& options = {}) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// A text that is one expression, as after `=` on the command line. Slips are faults in it, as in settings:
/// nobody would be told.
class ExpressionText {
 public:
  /// `wanted`: the type that its value is converted to. `name` is what messages call the text.
  /// @throws ScriptError with all faults.
  ExpressionText(const std::string& name, std::string text, const Type& wanted, const Registry& registry,
                 const std::vector<Given>& given = {});
  ~ExpressionText();

  /// `given` as the constructor was told of them, with the values that hold now; empty: those of then.
  /// @throws ScriptError; Cancelled.
  Value evaluate(Context& context, const std::vector<Given>& given = {}) const;
  /// All strings in it, such as the files that it may read.
  std::vector<std::string> strings() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// A script that comes line by line. What has been declared stays; a name may be declared again.
class Session {
 public:
  /// Both must outlive the session.
  Session(const Registry& registry, Context& context, const std::vector<Given>& given = {});
  ~Session();

  /// Carries out statements; a text that is one expression gives its value, others nothing. Faults are those
  /// of `name`.
  /// @throws ScriptError with all faults, after which the session can go on; Cancelled.
  Named enter(const std::string& text, const std::string& name = "input");
  /// What was allowed in the text entered last but is likely a slip, as messages.
  const std::vector<std::string>& warnings() const;
  /// Names of variables, for completion.
  std::vector<std::string> names() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The script with two spaces per level, one statement per line and one space around operators, as this
/// project writes them; comments and empty lines stay. Formatting again changes nothing.
/// @throws ScriptError with the faults of a script that cannot be parsed.
std::string formattedScript(const std::string& name, const std::string& text);

}  // namespace nephele::felt
