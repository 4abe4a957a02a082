#include "collapse/branch_record.h"

#include <fmt/format.h>

#include <limits>

#include "collapse/heads_across.h"
#include "collapse/plan_record.h"
#include "engines/engine.h"

namespace topple::collapse {

BranchRecord::BranchRecord(const Branch& b, const Knowledge& k, const RunOptions& options)
    : live_(b.run().model_pointer()),
      start_(b.pieces.front().run->model_pointer()),
      k_(k),
      branch_(b.id),
      time_(b.frontier()),
      has_ended_(b.run().has_ended()),
      options_(options),
      summary_(b.run().summary()) {
  for (const Piece& p : b.pieces)
    if (&p != &b.pieces.back()) summary_.wall_time += p.seconds;
  fill_provenance(options, "native", record_);
  fill_from_plan(live_->given_plan(), live_->model(), live_->map(), record_);
  for (const LiveModel::Applied& a : live_->applied())
    record_.plan_values.push_back({"Edits", fmt::format("Edit at {:.6g} s", a.time), a.text + "."});
  recorder_.emplace(live_->model(), live_->map(), k_, record_, nobody_);
  if (has_screening(live_->plan())) recorder_->keep_speeds();
  for (const Piece& p : b.pieces) {
    const bool is_last = &p == &b.pieces.back();
    recorder_->append(p.run->recorder(), is_last ? p.run->record().time.size() : p.frames,
                      is_last ? std::numeric_limits<double>::infinity() : p.time);
  }
}

std::optional<record::Record> BranchRecord::finish(const std::atomic<bool>* cancel) {
  if (has_ended_) {
    end_record(summary_, " before the first charge", *recorder_, record_);
  } else {
    record_.provenance.step = summary_.step;
    record_.provenance.wall_time = summary_.wall_time;
    // charges that are going to fail were told at the start
    std::erase_if(record_.events, [this](const record::Event& e) { return e.time > time_; });
    recorder_->finish();
    record_.ending = "under_way";
    record_.ending_text = fmt::format("The run is under way: computed up to {:.2f} s so far.", time_);
  }
  std::optional<HeadsAcross> across;
  if (has_heads(start_->map()) && (record_.ending == "at_rest" || record_.ending == "time_limit"))
    across = find_heads_across(start_->plan(), k_, options_, cancel,
                               [](const mbs::Model& model, const ModelMap&, const mbs::Options& o) {
                                 return engines::make_engine("native")->run(model, o);
                               });
  if (!record_.time.empty() && !add_findings(live_->plan(), live_->model(), live_->map(), k_, *recorder_, summary_,
                                             record_, cancel, across ? &*across : nullptr))
    return std::nullopt;
  return std::move(record_);
}

}  // namespace topple::collapse
