#include "engines/engine.h"

#include "base/error.h"

namespace topple::engines {

namespace {

class NativeEngine : public Engine {
 public:
  std::string name() const override { return "native"; }
  mbs::Summary run(const mbs::Model& model, const mbs::Options& options) const override {
    return mbs::run(model, options);
  }
};

}  // namespace

std::vector<std::string> engine_names() { return {"native"}; }

std::unique_ptr<Engine> make_engine(const std::string& name) {
  if (name == "native") return std::make_unique<NativeEngine>();
  std::string known;
  for (const std::string& n : engine_names()) known += (known.empty() ? "" : ", ") + n;
  throw InputError("E651", "there is no engine \"" + name + "\"", "engines: " + known);
}

}  // namespace topple::engines
