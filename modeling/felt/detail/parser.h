#pragma once

#include <string>
#include <vector>

#include "nephele/modeling/felt/detail/syntax.h"
#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::felt {

/// Statements of a text in order.
struct SyntaxTree {
  std::vector<StatementPtr> statements;
};

/// Parses `sources[file]`. Faults are added to `diagnostics`; what has one is left out of the tree.
SyntaxTree parse(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics);

/// Parses a text that is one expression; null if it has faults.
ExpressionPtr parseExpression(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics);

/// Parses the header of a built-in function, "scalarfield sphere(vector center, float radius = 1)", in which
/// types may be `any` and the last parameter `...`. @throws Error if it is none: a fault of the program.
struct ParsedSignature {
  FunctionDeclaration declaration;
  /// Further arguments of any type may follow.
  bool isOpen = false;
};
ParsedSignature parseSignature(const std::string& text);

}  // namespace nephele::felt
