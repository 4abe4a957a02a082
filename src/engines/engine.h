#pragma once
/// One interface to the programs that can solve a multibody model; the manager and `topple mbs compare` know only this.
/// docs/engines.md says what each of them can express and how another is added.

#include <memory>
#include <string>
#include <vector>

#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::engines {

/// Something in a model that an engine cannot express.
struct Unsupported {
  std::string place;  // joints[3] "hinge"
  std::string what;   // what about it: "limits of its reaction"
};

/// How accurate an engine shall be, beyond mbs::Options.
struct Accuracy {
  /// Relative error that engines with error control keep to by choosing their own steps; 0: steps of Options::step, or
  /// 1e-9 if that is 0 too. Engines without error control ignore it.
  double relative = 0;
};

class Engine {
 public:
  virtual ~Engine() = default;
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  virtual std::string name() const = 0;
  /// Of the library behind it; of topple for the native engine.
  virtual std::string version() const = 0;
  /// Everything in a checked model, or in a run of it as the options ask for, that the engine cannot express; empty: it
  /// can take the model.
  virtual std::vector<Unsupported> find_unsupported(const mbs::Model&, const mbs::Options&) const = 0;

  /// From the start to the end; calls Options::on_frame and on_happening as the native engine does. What a view does
  /// not know is left empty. Throws InputError if check_model does, or naming everything in find_unsupported;
  /// everything else is in the summary.
  mbs::Summary run(const mbs::Model&, const mbs::Options&) const;

 protected:
  /// Runs a model that is checked and that the engine can take.
  virtual mbs::Summary solve(const mbs::Model&, const mbs::Options&) const = 0;
};

/// What this program knows of an engine.
struct EngineInfo {
  std::string name;
  std::string version;  // empty: not built in
  std::string package;  // Debian package that it needs when building; empty: none
  bool is_available() const { return !version.empty(); }
};

/// All engines, those that are not built in included, the native one first.
std::vector<EngineInfo> list_engines();
/// Names that make_engine understands here.
std::vector<std::string> engine_names();
/// Throws InputError for an unknown name, and for an engine that is not built in.
std::unique_ptr<Engine> make_engine(const std::string& name, const Accuracy& = {});

/// The complaints as one error, E652; nothing if there are none.
void refuse_unsupported(const std::string& engine, const std::vector<Unsupported>&);

/// `joints[3] "hinge"`, as check_model names places.
std::string place_of(const char* list, size_t index, const std::string& name);

}  // namespace topple::engines
