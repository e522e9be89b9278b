// Prints what the lexer makes of a script: a line "begin end class" for every token and comment, as bytes of
// the file. Classes: number, string, comment, keyword, type, identifier, operator, punctuation.
#include <cstdio>

#include "nephele/modeling/base/text_file.h"
#include "nephele/modeling/felt/detail/token.h"
#include "nephele/modeling/felt/type.h"

namespace nephele::felt {
namespace {

const char* classOf(const Token& token) {
  switch (token.kind) {
    case TokenKind::integer:
    case TokenKind::number:
    case TokenKind::percent:
    case TokenKind::perSide:
      return "number";
    case TokenKind::text:
      return "string";
    case TokenKind::name:
      return !isKeyword(token.text) ? "identifier" : kindOf(token.text) ? "type" : "keyword";
    default:
      return std::string_view("(){}[],;.").find(token.text) == std::string_view::npos ? "operator"
                                                                                      : "punctuation";
  }
}

int printTokens(const char* path) {
  Sources sources;
  sources.add(path, readTextFile(path, 1 << 20));
  std::vector<Diagnostic> faults;
  const Tokens found = tokensOf(sources, 0, faults);
  for (const Diagnostic& fault : faults) std::fprintf(stderr, "%s\n", formatted(fault, sources).c_str());
  for (const Token& token : found.tokens)
    if (token.kind != TokenKind::end)
      std::printf("%d %d %s\n", token.span.begin, token.span.end, classOf(token));
  for (const Comment& comment : found.comments)
    std::printf("%d %d comment\n", comment.span.begin, comment.span.end);
  return faults.empty() ? 0 : 1;
}

}  // namespace
}  // namespace nephele::felt

int main(int argc, char** argv) {
  return argc == 2 ? nephele::felt::printTokens(argv[1]) : 2;
}
