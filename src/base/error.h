#pragma once
/// Bad input, positioned. The physics not working out is not an error of this kind: see the Summary of each solver.

#include <stdexcept>
#include <string>
#include <vector>

namespace topple {

/// A place in a text; line and column count from 1, 0 means unknown. Columns count characters (code points).
struct SourcePosition {
  std::string file;
  int line = 0;
  int column = 0;
};

enum class Severity { Error, Warning };

/// One complaint about the input.
struct Diagnostic {
  Severity severity = Severity::Error;
  std::string code;      // stable, "E203"
  SourcePosition where;  // where the offending words begin
  int width = 1;         // characters to underline; 0: the line is not shown
  std::string message;   // what is wrong, with the field, its value and the allowed range
  std::string help;      // what to do; may be empty
};

/// Thrown while reading, checking or building; carries every complaint found, at least one of them an error.
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Diagnostic> diagnostics);
  /// One complaint without a position.
  InputError(std::string code, std::string message, std::string help = {});
  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }
  /// What the input is refused for; warnings may stand before it.
  const Diagnostic& first_error() const;

 private:
  std::vector<Diagnostic> diagnostics_;
};

/// The complaint in the compiler's manner: place, message, the line of `text` with a caret, help.
/// `text` is the whole file; an empty one leaves the line out.
std::string render(const Diagnostic&, const std::string& text, bool colour);

/// The name in `known` nearest to `word` (edit distance at most a third of its length, a capital for a small letter
/// counts half), or an empty string.
std::string nearest_name(const std::string& word, const std::vector<std::string>& known);

}  // namespace topple
