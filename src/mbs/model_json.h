#pragma once
/// The multibody description as a file: JSON, SI, docs/mbs-model.md.

#include <string>

#include "mbs/model.h"

namespace topple::mbs {

std::string to_json(const Model&);
/// Reads what to_json writes. Throws InputError that names the place; `name` stands for the file.
Model model_from_json(const std::string& text, const std::string& name);

}  // namespace topple::mbs
