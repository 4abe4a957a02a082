#pragma once
/// Inputs with a mistake, and where it is to be found.

#include <string>

#include "base/error.h"

namespace topple::study {

/// The complaint with these words, else the first one.
inline Diagnostic find(const InputError& e, const std::string& words) {
  for (const Diagnostic& d : e.diagnostics())
    if ((d.message + d.help).find(words) != std::string::npos) return d;
  return e.first_error();
}

/// A text in which `from` is `to`, and the complaint: place, code and words of it.
struct Wrong {
  const char *from, *to;
  int line, column;
  const char *code, *words;
};

}  // namespace topple::study
