#pragma once
/// A plan's model that can be changed while it runs: bodies and connections stay, charges, cables, pre-cuts and
/// friction do not. A copy is independent.

#include <string>
#include <vector>

#include "collapse/builder.h"
#include "collapse/edit.h"

namespace topple::collapse {

/// A charge as it stands.
struct LiveCharge {
  int stage = 0, index = 0;  // in the plan, which holds added ones too
  double time = 0;           // when it fires [s]
  bool fails = false;        // as the plan says
  bool is_removed = false, is_added = false;
  double offset = 0;  // of `time` against the stage's time and the charge's delay: the scatter [s]
};

class LiveModel {
 public:
  /// Throws InputError as make_model does.
  LiveModel(product::Plan, const Knowledge&, int threads);
  LiveModel(const LiveModel&);
  LiveModel& operator=(const LiveModel&) = delete;

  const product::Plan& plan() const { return plan_; }
  const product::Plan& given_plan() const { return *given_; }  // before the edits
  const mbs::Model& model() const { return built_.model; }
  const ModelMap& map() const { return map_; }
  const Knowledge& knowledge() const { return *k_; }
  const std::vector<LiveCharge>& charges() const { return charges_; }
  const product::Charge& charge(const LiveCharge& c) const {
    return plan_.stages[static_cast<size_t>(c.stage)].charges[static_cast<size_t>(c.index)];
  }
  const std::string& member_of(const LiveCharge& c) const {
    return plan_.members[static_cast<size_t>(charge(c).member)].name;
  }
  /// Whether it has fired at a time of a run. At the start nothing has: what is due then fires with the first step.
  static bool has_fired(const LiveCharge&, double time);
  /// The edits, in their order.
  struct Applied {
    Edit edit;
    std::string text;
    double time = 0;  // [s]
  };
  const std::vector<Applied>& applied() const { return applied_; }
  size_t count_own_cables() const;  // of the plan, before those that edits added
  bool has_added_cable(const std::string& name) const;
  /// Law that a zone of the map follows before it is fired: of an element, or of a rotational one behind them; -1:
  /// none.
  int law_of_zone(size_t zone) const;
  /// Whether an edit lets a cable go.
  bool lets_go(const std::string& cable) const;

  /// Makes an edit at a time of the run and says it in words.
  ///   time  at 0, before the first step, what is due at the start can be changed too; the run must then begin anew [s]
  ///   next  time of the step after it, when what is to happen now happens [s]
  /// Throws InputError E912, E931, E932, E933; the model may then be used no longer.
  std::string apply(const Edit&, double time, double next);

 private:
  /// Below the lowest charge a column is a stump that stays (E933).
  void refuse_in_stump(int member, double position) const;
  /// After a charge of its own has changed: what it leaves of the member's zones.
  void request_zones_of(int member);
  void note_without_stump(const product::Charge&);
  std::string fire(const Edit&, double time, double next);
  std::string set_delay(const Edit&, double time);
  std::string add_charge(const Edit&, double time, double next);
  std::string remove_charge(const Edit&, double time);
  std::string add_pre_cut(const Edit&, double time);
  std::string add_cable(const Edit&);
  std::string remove_cable(const Edit&, double time, double next);
  std::string set_friction(const Edit&);
  LiveCharge& unfired(int charge, double time);
  int member_named(const std::string&) const;
  /// Events of charges and edits as they are now; what has fired comes out the same.
  void lay_out_events();

  std::shared_ptr<const product::Plan> given_;
  product::Plan plan_;
  const Knowledge* k_;
  ModelMap map_;
  BuilderState built_;
  std::vector<LiveCharge> charges_;
  // before any event
  std::vector<std::vector<mbs::Shape>> shapes_;       // of bodies
  std::vector<std::vector<record::BoxShape>> drawn_;  // of the map's bodies
  std::vector<Vec3> loose_;                           // translational stiffness of loosened joints, of their elements
  std::vector<std::string> cables_off_;               // removed ones
  struct Extra {
    mbs::Event event;
    EventEntry entry;
  };
  std::vector<Extra> extras_;
  std::vector<Applied> applied_;
};

}  // namespace topple::collapse
