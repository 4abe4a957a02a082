#include "collapse/keeper.h"

#include <fmt/format.h>

#include <stdexcept>

#include "base/checkpoint.h"
#include "base/error.h"
#include "base/hash.h"
#include "mbs/model_json.h"

namespace topple::collapse {

namespace {

constexpr const char* kKind = "topple-checkpoint-1";

}  // namespace

std::string write_rules(const Knowledge& k) {
  std::string text;
  for (const Rule& rule : k.rules) text += fmt::format("{} {}\n", rule.id, rule.value);
  return text;
}

Keeper::Keeper(const RunOptions& options, const RunCallbacks& callbacks, Recorder& recorder)
    : options_(options), callbacks_(callbacks), recorder_(recorder) {}

void Keeper::join(const mbs::Model& model, const std::string& of, mbs::Options& o) {
  if (options_.checkpoint.empty()) return;
  if (options_.engine != "native")
    throw InputError("E674", fmt::format("{} keeps no checkpoint and goes on from none", options_.engine),
                     "the native engine does");
  key_ = calc_sha256(fmt::format("{}\n{}\n{} {} {} {} {} {} {} {}", mbs::to_json(model), of, options_.program_version,
                                 o.step, o.step_safety, o.step_share, o.most_turn, o.frame_interval, o.equilibrium,
                                 o.rest_speed));
  if (options_.resume) {
    CheckpointFile file(options_.checkpoint, kKind, key_, "plan or model, step, frame rate or version");
    mbs::read_moment(file.contents(), moment_);
    recorder_.read(file.contents());
    file.close();
    if (!(moment_.time < o.duration))
      throw InputError("E674",
                       fmt::format("{}: the run has come to {:.4g} s, and is to end at {:.4g} s", options_.checkpoint,
                                   moment_.time, o.duration),
                       "go on to a later time, or start without --resume");
    o.from = &moment_;
    if (callbacks_.on_resume) callbacks_.on_resume(moment_.time);
  }
  o.moment_interval = options_.checkpoint_interval;
  o.on_moment = [this](const mbs::Moment& m) {
    try {
      write_checkpoint_file(options_.checkpoint, kKind, key_, [&](ArchiveWriter& out) {
        mbs::write_moment(m, out);
        recorder_.write(out);
      });
    } catch (const std::runtime_error& e) {  // a full disk takes no results
      if (callbacks_.on_lost_checkpoint) callbacks_.on_lost_checkpoint(e.what());
      return;
    }
    if (callbacks_.on_checkpoint) callbacks_.on_checkpoint();
  };
}

}  // namespace topple::collapse
