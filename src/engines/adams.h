#pragma once
/// A model as a dataset of MSC.ADAMS (Adams/Solver), with the commands that run it. docs/exports.md says what stands
/// for what. Written from the public reference of the format; no ADAMS has been asked.

#include <string>
#include <vector>

#include "mbs/model.h"
#include "mbs/model_json.h"

namespace topple::engines {

struct AdamsFiles {
  std::string dataset;             // .adm
  std::string commands;            // .acf: equilibrium, the run, what events take away
  std::vector<std::string> notes;  // what the dataset says otherwise than the model, in sentences
};

/// SI, degrees where angles are typed. Bodies, ideal joints, springs, bushings, loads, cables and the ground stand for
/// themselves. Zones are elastic bushings; the moment of a rotational element follows its family of curves, but gives
/// back on unloading what it took. The notes name everything that is lost.
///   name  of the dataset's file without .adm; the commands load it
AdamsFiles to_adams(const mbs::Model&, const mbs::RunSettings&, const std::string& name);

}  // namespace topple::engines
