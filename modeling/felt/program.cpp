#include "nephele/modeling/felt/program.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/text_file.h"
#include "nephele/modeling/felt/detail/checker.h"
#include "nephele/modeling/felt/detail/interpreter.h"
#include "nephele/modeling/felt/detail/parser.h"

namespace nephele::felt {

namespace {

constexpr std::size_t kMostFiles = 200;
constexpr std::size_t kLongestScript = std::size_t(16) << 20;

bool hasErrors(const std::vector<Diagnostic>& diagnostics) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [](const Diagnostic& diagnostic) { return diagnostic.severity == Severity::error; });
}

/// Where nobody would be told of slips they are faults.
void requireNoSlips(std::vector<Diagnostic> diagnostics, const Sources& sources) {
  if (diagnostics.empty()) return;
  for (Diagnostic& diagnostic : diagnostics) diagnostic.severity = Severity::error;
  throw ScriptError(std::move(diagnostics), sources);
}

/// Where an import stands is what its file says; a file that is imported twice says it once.
class Loader {
 public:
  Loader(Sources& sources, std::vector<Diagnostic>& diagnostics)
      : sources_(sources), diagnostics_(diagnostics) {}

  /// The statements of a file of the sources, with those of what it imports.
  std::vector<StatementPtr> load(int file) {
    seen_.insert(canonical(sources_[file].name()));
    std::vector<StatementPtr> statements;
    append(file, statements);
    return statements;
  }

 private:
  static std::string canonical(const std::string& path) {
    std::error_code failed;
    const auto found = std::filesystem::weakly_canonical(path, failed);
    return failed ? path : found.string();
  }

  void append(int file, std::vector<StatementPtr>& statements) {
    SyntaxTree tree = parse(sources_, file, diagnostics_);
    for (StatementPtr& statement : tree.statements) {
      if (statement->kind == StatementKind::import)
        import(*statement, statements);
      else
        statements.push_back(std::move(statement));
    }
  }

  void import(const Statement& statement, std::vector<StatementPtr>& statements) {
    std::filesystem::path path(statement.path);
    if (path.is_relative())
      path = std::filesystem::path(sources_[statement.span.file].name()).parent_path() / path;
    if (!seen_.insert(canonical(path.string())).second) return;
    if (seen_.size() > kMostFiles) {
      diagnostics_.push_back(
          {Code::limit, statement.span, "more than " + std::to_string(kMostFiles) + " files are imported"});
      return;
    }
    std::string text;
    try {
      text = readTextFile(path.string(), kLongestScript);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      diagnostics_.push_back({Code::importFailed, statement.span, error.what(),
                              "files are sought beside the script that imports them"});
      return;
    }
    append(sources_.add(path.string(), std::move(text)), statements);
  }

  Sources& sources_;
  std::vector<Diagnostic>& diagnostics_;
  std::set<std::string> seen_;
};

/// What `work` gives; its faults are told with the sources that they stand in.
template <class Work>
auto tellingFaults(const Sources& sources, const Work& work) {
  try {
    return work();
  } catch (RunFault& fault) {
    throw ScriptError({std::move(fault.diagnostic)}, sources);
  }
}

ScriptParameter described(const ParameterDeclaration& parameter, const Sources& sources) {
  ScriptParameter result;
  result.name = parameter.declared.name;
  result.type = parameter.declared.type;
  result.standard = std::string(sources.textOf(parameter.declared.value->span));
  for (const ExpressionPtr& allowed : parameter.allowed)
    result.allowed.emplace_back(sources.textOf(allowed->span));
  const bool isNumber = result.type.kind == Kind::integer || result.type.kind == Kind::number;
  result.isChoice = !result.allowed.empty() && (!isNumber || result.allowed.size() > 2);
  result.isColor = parameter.isColor;
  result.text = parameter.text;
  return result;
}

void setGiven(std::vector<Value>& globals, const std::vector<Given>& given, const Checker& checker) {
  for (std::size_t i = 0; i < given.size(); ++i)
    if (checker.globals()[i].reads > 0) globals[i] = given[i].make ? given[i].make() : given[i].value;
}

void addStrings(const Expression& expression, std::vector<std::string>& found) {
  if (expression.kind == ExpressionKind::literal && expression.literal.is<std::string>())
    found.push_back(expression.literal.as<std::string>());
  for (const ExpressionPtr& part : expression.parts)
    if (part) addStrings(*part, found);
}

}  // namespace

struct Program::Parts {
  explicit Parts(const Registry& registry_) : registry(registry_), checker(registry_) {}

  const ParameterDeclaration* parameterCalled(const std::string& name) const {
    for (const StatementPtr& statement : statements)
      if (statement->kind == StatementKind::parameter && statement->parameter->declared.name == name)
        return statement->parameter.get();
    return nullptr;
  }
  /// The value of a parameter, which must live as long as the interpreter.
  ExpressionPtr set(Interpreter& interpreter, Checker& scope, Sources& all, const std::string& name,
                    const std::string& text) const;

  const Registry& registry;
  Sources sources;
  Checker checker;
  std::vector<StatementPtr> statements;
  std::vector<Given> given;
  std::vector<ScriptParameter> parameters;
  std::vector<Diagnostic> warnings;
};

Program::Program(const std::string& name, std::string text, const Registry& registry,
                 const std::vector<Given>& given)
    : parts_(std::make_unique<Parts>(registry)) {
  parts_->given = given;
  for (const Given& one : given) parts_->checker.declare(one.name, one.type);
  std::vector<Diagnostic> diagnostics;
  parts_->statements = Loader(parts_->sources, diagnostics).load(parts_->sources.add(name, std::move(text)));
  parts_->checker.check(parts_->statements, diagnostics);
  if (hasErrors(diagnostics)) throw ScriptError(std::move(diagnostics), parts_->sources);
  parts_->warnings = std::move(diagnostics);
  for (const StatementPtr& statement : parts_->statements)
    if (statement->kind == StatementKind::parameter)
      parts_->parameters.push_back(described(*statement->parameter, parts_->sources));
}

Program Program::fromFile(const std::string& path, const Registry& registry,
                          const std::vector<Given>& given) {
  return Program(path, readTextFile(path, kLongestScript), registry, given);
}

Program::~Program() = default;
Program::Program(Program&&) noexcept = default;
Program& Program::operator=(Program&&) noexcept = default;

const std::vector<Diagnostic>& Program::warnings() const {
  return parts_->warnings;
}
const Sources& Program::sources() const {
  return parts_->sources;
}
const std::vector<ScriptParameter>& Program::parameters() const {
  return parts_->parameters;
}

std::optional<Type> Program::typeOf(const std::string& name) const {
  const int slot = parts_->checker.slotOf(name);
  if (slot < static_cast<int>(parts_->given.size())) return std::nullopt;
  return parts_->checker.globals()[slot].type;
}

ExpressionPtr Program::Parts::set(Interpreter& interpreter, Checker& scope, Sources& all,
                                  const std::string& name, const std::string& text) const {
  const ParameterDeclaration* const parameter = parameterCalled(name);
  if (parameter == nullptr) {
    std::vector<std::string> names;
    std::string list;
    for (const ScriptParameter& known : parameters) {
      names.push_back(known.name);
      list += (list.empty() ? "" : ", ") + known.name;
    }
    const std::string near = nearestName(name, names);
    throw Error("setting " + quoted(name, 60) + ": " + sources[0].name() + " has no such parameter; " +
                (!near.empty()  ? "did you mean " + near + "?"
                 : list.empty() ? "it declares none"
                                : "it has " + list));
  }
  std::vector<Diagnostic> diagnostics;
  const Type type = parameter->declared.type;
  // Words of a choice need no quotes on a command line.
  const bool isWord = type == Type{Kind::text} && !text.starts_with("\"");
  const int file = all.add("setting " + name, text);
  ExpressionPtr expression;
  if (isWord) {
    expression = std::make_unique<Expression>();
    expression->span = {file, 0, static_cast<int>(text.size())};
    expression->literal = text;
    expression->type = type;
  } else {
    expression = parseExpression(all, file, diagnostics);
    if (expression) scope.checkExpression(expression, type, diagnostics);
  }
  requireNoSlips(std::move(diagnostics), all);
  interpreter.set(parameter->declared.slot, *expression);
  return expression;
}

std::vector<Named> Program::run(Context& context, const RunOptions& options) const {
  Interpreter interpreter(parts_->checker, context);
  if (options.countsOperations) interpreter.keepParts();
  std::vector<Value>& globals = interpreter.globals();
  globals.resize(parts_->checker.globals().size());
  setGiven(globals, options.given.empty() ? parts_->given : options.given, parts_->checker);

  Sources all = parts_->sources;
  Checker scope(parts_->registry);
  for (const Given& one : parts_->given) scope.declare(one.name, one.type);
  return tellingFaults(all, [&] {
    std::vector<ExpressionPtr> set;
    for (const auto& [name, text] : options.settings)
      set.push_back(parts_->set(interpreter, scope, all, name, text));
    interpreter.run(parts_->statements);
    std::vector<Named> result;
    const std::vector<Variable>& variables = parts_->checker.globals();
    for (std::size_t i = parts_->given.size(); i < variables.size(); ++i) {
      if (!variables[i].isOutermost) continue;
      Named named{variables[i].name, variables[i].type, globals[i]};
      if (options.countsOperations && named.type.isField() && named.value.isSet())
        named.operations = interpreter.operationsOf(named.value);
      result.push_back(std::move(named));
    }
    return result;
  });
}

struct ExpressionText::Parts {
  explicit Parts(const Registry& registry) : checker(registry) {}

  Sources sources;
  Checker checker;
  ExpressionPtr expression;
  std::vector<Given> given;
};

ExpressionText::ExpressionText(const std::string& name, std::string text, const Type& wanted,
                               const Registry& registry, const std::vector<Given>& given)
    : parts_(std::make_unique<Parts>(registry)) {
  parts_->given = given;
  for (const Given& one : given) parts_->checker.declare(one.name, one.type);
  std::vector<Diagnostic> diagnostics;
  const int file = parts_->sources.add(name, std::move(text));
  parts_->expression = parseExpression(parts_->sources, file, diagnostics);
  if (parts_->expression) parts_->checker.checkExpression(parts_->expression, wanted, diagnostics);
  requireNoSlips(std::move(diagnostics), parts_->sources);
}

ExpressionText::~ExpressionText() = default;

std::vector<std::string> ExpressionText::strings() const {
  std::vector<std::string> found;
  addStrings(*parts_->expression, found);
  return found;
}

Value ExpressionText::evaluate(Context& context, const std::vector<Given>& given) const {
  Interpreter interpreter(parts_->checker, context);
  interpreter.globals().resize(parts_->given.size());
  setGiven(interpreter.globals(), given.empty() ? parts_->given : given, parts_->checker);
  return tellingFaults(parts_->sources, [&] { return interpreter.evaluate(*parts_->expression); });
}

struct Session::Parts {
  Parts(const Registry& registry, Context& context) : checker(registry), interpreter(checker, context) {}

  Sources sources;
  Checker checker;
  Interpreter interpreter;
  /// What was entered stays: functions point into it.
  std::vector<std::vector<StatementPtr>> entered;
  std::vector<std::string> warnings;

  void keepWarnings(const std::vector<Diagnostic>& diagnostics) {
    if (hasErrors(diagnostics)) throw ScriptError(diagnostics, sources);
    for (const Diagnostic& diagnostic : diagnostics) warnings.push_back(formatted(diagnostic, sources));
  }
};

Session::Session(const Registry& registry, Context& context, const std::vector<Given>& given)
    : parts_(std::make_unique<Parts>(registry, context)) {
  for (const Given& one : given) {
    parts_->checker.declare(one.name, one.type);
    parts_->interpreter.globals().push_back(one.make ? one.make() : one.value);
  }
}

Session::~Session() = default;

Named Session::enter(const std::string& text, const std::string& name) {
  Sources& sources = parts_->sources;
  parts_->warnings.clear();
  const int file = sources.add(name, text);
  // A text is an expression if it can be read as one; else what is wrong with it as statements is told.
  std::vector<Diagnostic> ofExpression;
  if (ExpressionPtr expression = parseExpression(sources, file, ofExpression)) {
    std::vector<Diagnostic> diagnostics;
    parts_->checker.checkExpression(expression, {}, diagnostics);
    parts_->keepWarnings(diagnostics);
    return tellingFaults(sources, [&] {
      parts_->interpreter.begin();
      return Named{"", expression->type, parts_->interpreter.evaluate(*expression)};
    });
  }
  std::vector<Diagnostic> diagnostics;
  std::vector<StatementPtr> statements = Loader(sources, diagnostics).load(file);
  if (!hasErrors(diagnostics)) parts_->checker.check(statements, diagnostics, true);
  parts_->keepWarnings(diagnostics);
  parts_->entered.push_back(std::move(statements));
  return tellingFaults(sources, [&] {
    parts_->interpreter.run(parts_->entered.back());
    return Named{};
  });
}

const std::vector<std::string>& Session::warnings() const {
  return parts_->warnings;
}

std::vector<std::string> Session::names() const {
  std::vector<std::string> names;
  for (const Variable& variable : parts_->checker.globals())
    if (variable.isOutermost) names.push_back(variable.name);
  return names;
}

}  // namespace nephele::felt
