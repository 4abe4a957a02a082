#pragma once
/// One interface to the programs that can solve a multibody model; the manager knows only this.

#include <memory>
#include <string>
#include <vector>

#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::engines {

class Engine {
 public:
  virtual ~Engine() = default;
  virtual std::string name() const = 0;
  /// From the start to the end. Throws InputError for models it cannot take; everything else is in the summary.
  virtual mbs::Summary run(const mbs::Model&, const mbs::Options&) const = 0;
};

/// Names that make_engine understands.
std::vector<std::string> engine_names();
/// Throws InputError for an unknown name.
std::unique_ptr<Engine> make_engine(const std::string& name);

}  // namespace topple::engines
