#pragma once
/// The multibody description as a file: JSON, SI, docs/mbs-model.md.

#include <optional>
#include <string>
#include <vector>

#include "mbs/model.h"

namespace topple::mbs {

struct Options;

/// How a file wants to be run; what it leaves out is for the program to choose.
struct RunSettings {
  double duration = 0;               // 0: not given [s]
  double step = 0;                   // 0: from the stiffest mode [s]
  double stability_share = 0.1;      // of that mode's limit, in (0, 1]; Options::step_safety
  double frame_interval = 0;         // 0: not given [s]
  std::optional<bool> equilibrium;   // start from the dead-load equilibrium
  std::optional<double> rest_speed;  // stop when everything is slower; 0: never [m/s]
};

/// Steps of a model whose modes nobody knows beforehand, and all of which count.
void choose_steps(const RunSettings&, Options&);

/// Items refer to each other by their place in the list. Numbers come back as they are.
std::string to_json(const Model&, const RunSettings& = {});

/// Reads a file of version 1 or 2 and checks it (check_model). Throws InputError with the complaints found, each with
/// its path, line and column; `name` stands for the file. Settings of the run go to `run` if that is given.
Model model_from_json(const std::string& text, const std::string& name, RunSettings* run = nullptr);

/// Throws InputError (E601), placed in the text the model is of, where bodies have velocities: a run that begins with
/// the equilibrium would lose them.
void refuse_velocities(const Model&, const std::string& text, const std::string& name);

/// The keys that an object of the file may have, by the name of the object in docs/mbs-model.schema.json; "model" is
/// the file itself.
struct KeyList {
  std::string object;
  std::vector<std::string> keys;
};
const std::vector<KeyList>& model_json_keys();

}  // namespace topple::mbs
