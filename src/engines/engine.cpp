#include "engines/engine.h"

#include "base/error.h"
#include "engines/mujoco.h"
#include "engines/simbody.h"

namespace topple::engines {

namespace {

class NativeEngine : public Engine {
 public:
  std::string name() const override { return "native"; }
  std::string version() const override { return TOPPLE_VERSION; }
  std::vector<Unsupported> find_unsupported(const mbs::Model&, const mbs::Options&) const override { return {}; }

 protected:
  mbs::Summary solve(const mbs::Model& model, const mbs::Options& options) const override {
    return mbs::run(model, options);
  }
};

}  // namespace

mbs::Summary Engine::run(const mbs::Model& model, const mbs::Options& options) const {
  mbs::check_model(model);
  refuse_unsupported(name(), find_unsupported(model, options));
  return solve(model, options);
}

std::vector<EngineInfo> list_engines() {
  return {{"native", TOPPLE_VERSION, ""},
          {"simbody", simbody_version(), "libsimbody-dev"},
          {"mujoco", mujoco_version(), "libmujoco-dev"}};
}

std::vector<std::string> engine_names() {
  std::vector<std::string> names;
  for (const EngineInfo& e : list_engines())
    if (e.is_available()) names.push_back(e.name);
  return names;
}

std::unique_ptr<Engine> make_engine(const std::string& name, const Accuracy& accuracy) {
  std::vector<std::string> known;
  for (const EngineInfo& e : list_engines()) {
    known.push_back(e.name);
    if (e.name != name) continue;
    if (!e.is_available())
      throw InputError("E653", "engine \"" + name + "\" is not built in",
                       "install " + e.package + " (script/bootstrap test) and configure and build again");
    if (name == "simbody") return make_simbody_engine(accuracy);
    if (name == "mujoco") return make_mujoco_engine();
    return std::make_unique<NativeEngine>();
  }
  std::string list;
  for (const std::string& n : known) list += (list.empty() ? "" : ", ") + n;
  const std::string near = nearest_name(name, known);
  throw InputError("E651", "there is no engine \"" + name + "\"",
                   (near.empty() ? "" : "did you mean \"" + near + "\"? ") + "engines: " + list);
}

void refuse_unsupported(const std::string& engine, const std::vector<Unsupported>& list) {
  if (list.empty()) return;
  std::vector<Diagnostic> out;
  for (const Unsupported& u : list) {
    Diagnostic d;
    d.code = "E652";
    d.message = u.place + ": engine \"" + engine + "\" cannot express " + u.what;
    out.push_back(d);
  }
  out.back().help = "the native engine takes every model; docs/engines.md says what the others can express";
  throw InputError(std::move(out));
}

std::string place_of(const char* list, size_t index, const std::string& name) {
  return std::string(list) + "[" + std::to_string(index) + "]" + (name.empty() ? "" : " \"" + name + "\"");
}

}  // namespace topple::engines
