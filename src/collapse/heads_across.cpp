#include "collapse/heads_across.h"

#include <algorithm>

#include "collapse/plan_record.h"

namespace topple::collapse {

bool has_heads(const ModelMap& map) {
  return std::any_of(map.ground_columns.begin(), map.ground_columns.end(),
                     [&map](const GroundColumn& g) { return map.bodies[static_cast<size_t>(g.body)].kind != "shaft"; });
}

HeadsAcross find_heads_across(const product::Plan& plan, const Knowledge& k, const RunOptions& options,
                              const std::atomic<bool>* cancel, const Mover& move) {
  ModelMap map;
  const mbs::Model model = make_model(plan, k, map, options.threads, Heads::Across);
  HeadsAcross out;
  const RunCallbacks nobody;
  Recorder recorder(model, map, k, out.record, nobody);
  mbs::RunSettings settings = settings_of(plan, k, options);
  settings.duration = settings.step = 1e-6;  // the first frame alone matters
  mbs::Options o = make_mbs_options(settings, k, options.threads, {{}, cancel});
  record_into(recorder, o);
  if (move(model, map, o).ending != mbs::Summary::Ending::NoEquilibrium) out.zones = recorder.zone_frames();
  return out;
}

void tell_heads_left_out(record::Record& r) {
  for (record::Finding& f : r.findings) {
    if (f.id != "stability.start") continue;
    f.text += " About the other axis of the columns' heads it was not computed: cancelled.";
    if (f.status == record::Status::Good) f.status = record::Status::Warning;
  }
}

}  // namespace topple::collapse
