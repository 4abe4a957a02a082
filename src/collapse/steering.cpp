#include "collapse/steering.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/utf8.h"
#include "collapse/branch_record.h"

namespace topple::collapse {

namespace {

constexpr size_t kLongestName = 80;

void tell_edit(const Edit& e, const std::string& text, double time, LiveRun& run) {
  run.tell({time, "edit", e.member.empty() ? e.cable : e.member, text});
}

/// Whether an edit changes what the first evaluation of forces has acted upon already, before the first step.
bool changes_start(const Edit& e, const mbs::Moment& moment, const LiveModel& live) {
  if (moment.steps > 0) return false;
  using Kind = Edit::Kind;
  // it pulls in the equilibrium, or weakens what stands in it
  if (e.kind == Kind::AddCable || e.kind == Kind::AddPreCut) return true;
  // one that has never pulled is taken out of it
  if (e.kind == Kind::RemoveCable) return live.has_added_cable(e.cable);
  if (e.kind == Kind::SetFriction) return false;
  const auto is_due = [&](const mbs::Event& event) { return event.time <= moment.time; };
  return !moment.fired.empty() || std::any_of(live.model().events.begin(), live.model().events.end(), is_due);
}

/// Whether it sets what is there already, so that the run goes on with the bits that it would have had.
bool changes_nothing(const Edit& e, const LiveModel& before, const LiveModel& after) {
  if (e.kind == Edit::Kind::SetFriction) {
    const mbs::Contact &a = before.model().contact, &b = after.model().contact;
    return a.friction == b.friction && a.body_friction == b.body_friction;
  }
  if (e.kind != Edit::Kind::SetDelay) return false;
  return std::equal(before.charges().begin(), before.charges().end(), after.charges().begin(),
                    [](const LiveCharge& a, const LiveCharge& b) { return a.time == b.time; });
}

/// Frames of a branch that goes on from others.
size_t count_shared(const Branch& b) {
  size_t n = 0;
  for (size_t i = 0; i + 1 < b.pieces.size(); ++i) n += b.pieces[i].frames;
  return n;
}

}  // namespace

size_t Branch::frames() const { return count_shared(*this) + run().record().time.size(); }

std::pair<const Piece*, size_t> Branch::find_frame(size_t frame) const {
  for (const Piece& p : pieces) {
    const size_t n = &p == &pieces.back() ? p.run->record().time.size() : p.frames;
    if (frame < n) return {&p, frame};
    frame -= n;
  }
  throw InputError("E920", "there is no such frame");
}

Steering::Steering(const Knowledge& k, SteeringOptions options, SteeringCallbacks callbacks)
    : k_(k), options_(std::move(options)), callbacks_(std::move(callbacks)) {}

Branch& Steering::branch(int id) const {
  for (const auto& b : branches_)
    if (b->id == id) return *b;
  throw InputError("E920", fmt::format("there is no branch {}", id));
}

std::string Steering::name_of_new(const std::string& wanted) const {
  if (branches_.size() >= options_.most_branches)
    throw InputError("E905", fmt::format("there are {} branches, which is the limit", branches_.size()),
                     "go on in a session of its own");
  return free_name(wanted);
}

std::string Steering::free_name(const std::string& wanted) const {
  const auto is_taken = [this](const std::string& name) {
    return std::any_of(branches_.begin(), branches_.end(), [&](const auto& b) { return b->name == name; });
  };
  if (!wanted.empty()) {
    if (wanted.find_first_not_of(' ') == std::string::npos)
      throw InputError("E912", "a name has at least one character that is no blank");
    if (count_characters(wanted) > kLongestName)
      throw InputError("E912", fmt::format("a name has at most {} characters", kLongestName));
    if (std::any_of(wanted.begin(), wanted.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
      throw InputError("E912", "a name holds no line breaks or other control characters");
    if (is_taken(wanted)) throw InputError("E912", "there is a branch \"" + wanted + "\" already");
    return wanted;
  }
  for (int n = 1;; ++n)
    if (std::string name = fmt::format("what-if {}", n); !is_taken(name)) return name;
}

Branch& Steering::add_branch(Branch b) {
  b.id = static_cast<int>(branches_.size()) + 1;
  branches_.push_back(std::make_unique<Branch>(std::move(b)));
  Branch& made = *branches_.back();
  if (active_ > 0) active().run().rest();
  active_ = made.id;
  go_live();
  watch(made);
  if (callbacks_.on_branch) callbacks_.on_branch(made);
  return made;
}

void Steering::watch(Branch& b) {
  Branch* const branch = &b;
  b.run().on_event = [this, branch](const record::Event& e) {
    if (callbacks_.on_event) callbacks_.on_event(*branch, e);
  };
  b.run().on_frame = [this, branch] {
    if (callbacks_.on_frame) callbacks_.on_frame(*branch, branch->frames() - 1);
  };
}

Branch& Steering::add_root(const product::Plan& plan, const std::string& name) {
  Branch b;
  b.name = name_of_new(name);
  const auto model = std::make_shared<const LiveModel>(plan, k_, options_.run.threads);
  b.pieces.push_back({std::make_shared<LiveRun>(model, options_.run, options_.moment_interval), 0, 0, 0});
  return add_branch(std::move(b));
}

bool Steering::begin(Branch& b) {
  const bool good = b.run().begin();
  if (callbacks_.on_branch) callbacks_.on_branch(b);
  return good;
}

void Steering::switch_to(int id) {
  Branch& b = branch(id);
  if (id != active_) active().run().rest();
  active_ = id;
  go_live();
  if (callbacks_.on_branch) callbacks_.on_branch(b);
}

void Steering::rename(int id, const std::string& name) {
  Branch& b = branch(id);
  if (name == b.name) return;
  if (name.empty()) throw InputError("E912", "a name has at least one character");
  b.name = free_name(name);
  if (callbacks_.on_branch) callbacks_.on_branch(b);
}

bool Steering::advance() {
  LiveRun& run = active().run();
  const size_t kept = run.moments().size();
  const bool goes_on = run.advance();
  if (run.moments().size() != kept) thin_out();
  return goes_on;
}

void Steering::advance_to(Branch& b, long step) {
  if (!b.run().begin()) return;
  while (b.steps() < step) {
    const size_t kept = b.run().moments().size();
    if (!b.run().advance()) break;
    if (b.run().moments().size() != kept) thin_out();
  }
}

std::size_t Steering::moment_bytes() const {
  std::set<const LiveRun*> runs;
  std::size_t sum = 0;
  for (const auto& b : branches_)
    for (const Piece& p : b->pieces)
      if (runs.insert(p.run.get()).second) sum += p.run->moment_bytes();
  return sum;
}

void Steering::thin_out() {
  if (moment_bytes() <= options_.moment_bytes) return;
  std::set<LiveRun*> runs;
  for (const auto& b : branches_)
    for (const Piece& p : b->pieces)
      if (runs.insert(p.run.get()).second) p.run->thin_out();
}

std::vector<double> Steering::moments(const Branch& b) const {
  std::vector<double> times;
  for (const Piece& p : b.pieces)
    for (const mbs::Moment& m : p.run->moments())
      if (&p == &b.pieces.back() || m.steps <= p.step)
        if (times.empty() || m.time > times.back()) times.push_back(m.time);
  return times;
}

void Steering::rewind(double time) {
  const Branch& b = active();
  size_t lo = 0, hi = b.frames();  // the first later frame
  while (lo < hi) {
    const size_t middle = (lo + hi) / 2;
    const auto [piece, i] = b.find_frame(middle);
    if (piece->run->record().time[i] <= time)
      lo = middle + 1;
    else
      hi = middle;
  }
  if (lo == 0) throw InputError("E920", fmt::format("branch \"{}\" has no frame at or before {:g} s", b.name, time));
  rewind_to_frame(lo - 1);
}

void Steering::rewind_to_frame(size_t frame) {
  (void)active().find_frame(frame);
  cursor_ = {active_, false, frame};
}

double Steering::cursor_time() const {
  const Branch& b = active();
  if (cursor_.is_live) return b.frontier();
  const auto [piece, i] = b.find_frame(cursor_.frame);
  return piece->run->record().time[i];
}

long Steering::cursor_step() const {
  const Branch& b = active();
  if (cursor_.is_live) return b.steps();
  const auto [piece, i] = b.find_frame(cursor_.frame);
  return piece->run->frame_steps()[i];
}

std::vector<Piece> Steering::cut(const Branch& b, const Cursor& cursor) const {
  std::vector<Piece> pieces;
  if (cursor.is_live) {
    pieces = b.pieces;
    Piece& last = pieces.back();
    last.frames = last.run->record().time.size();
    last.step = last.run->steps();
    last.time = last.run->time();
    last.seconds = last.run->seconds();
    return pieces;
  }
  const auto [piece, i] = b.find_frame(cursor.frame);
  for (const Piece& p : b.pieces) {
    pieces.push_back(p);
    if (&p != piece) continue;
    pieces.back().frames = i + 1;
    pieces.back().step = p.run->frame_steps()[i];
    pieces.back().time = p.run->record().time[i];
    pieces.back().seconds = p.run->frame_seconds()[i];
    return pieces;
  }
  return pieces;
}

std::shared_ptr<LiveRun> Steering::go_on(const std::vector<Piece>& pieces, std::shared_ptr<const LiveModel> model,
                                         bool is_successor) const {
  const Piece& last = pieces.back();
  return std::make_shared<LiveRun>(std::move(model), options_.run, options_.moment_interval,
                                   last.run->moment_at(last.step), is_successor, last.run->recorder());
}

Steering::Made Steering::edit(const Edit& e, const std::string& name, bool in_place) {
  Branch& from = active();
  if (!from.run().has_begun() || from.run().moments().empty())
    throw InputError("E930", "the branch has no equilibrium to go on from");
  const std::vector<Piece> base = cut(from, cursor_);
  const Piece& last = base.back();
  const bool stays = cursor_.is_live && (in_place || last.run->steps() == last.run->start_steps());
  const std::string new_name = stays ? from.name : name_of_new(name);
  if (const size_t edits = last.run->model().applied().size(); edits >= options_.most_edits)
    throw InputError("E905", fmt::format("the branch has {} edits, which is the limit", edits));
  // the edits along it and the branches that it has come from
  if (base.size() > options_.most_edits)
    throw InputError("E905", fmt::format("the branch consists of {} stretches, which is the limit", base.size()));

  const mbs::Moment moment = last.run->moment_at(last.step);
  auto model = std::make_shared<LiveModel>(last.run->model());
  Made made;
  made.text = model->apply(e, moment.time, moment.next_time);
  made.time = moment.time;
  made.step = moment.steps;
  const bool is_anew = changes_start(e, moment, *model);
  std::shared_ptr<LiveRun> run;
  if (is_anew) {
    run = std::make_shared<LiveRun>(std::move(model), options_.run, options_.moment_interval);
    if (!run->begin()) throw InputError("E932", made.text + ": " + run->summary().message);
    // those before it were told by runs that the branch has no more
    const std::vector<LiveModel::Applied>& applied = run->model().applied();
    for (size_t i = 0; i + 1 < applied.size(); ++i) tell_edit(applied[i].edit, applied[i].text, applied[i].time, *run);
  } else {
    const bool is_successor = !changes_nothing(e, last.run->model(), *model);
    run = std::make_shared<LiveRun>(std::move(model), options_.run, options_.moment_interval, moment, is_successor,
                                    last.run->recorder());
  }
  const EditEntry entry{e, made.text, made.time, !stays, from.id, base, from.first_frame};
  std::vector<Piece> pieces;
  if (!is_anew) pieces = base;
  pieces.push_back({run, 0, 0, 0});
  if (stays) {
    from.run().rest();
    from.pieces = std::move(pieces);
    from.edits.push_back(entry);
    if (is_anew) start_anew(from, 0);
    watch(from);
    go_live();
    made.branch = &from;
  } else {
    Branch b;
    b.name = new_name;
    b.parent = from.id;
    b.time = made.time;
    b.pieces = std::move(pieces);
    b.first_frame = count_shared(b);
    b.edits.push_back(entry);
    b.sample = from.sample;
    made.branch = &add_branch(std::move(b));
  }
  tell_edit(e, made.text, made.time, *run);
  if (stays && callbacks_.on_branch) callbacks_.on_branch(from);
  return made;
}

void Steering::start_anew(Branch& b, size_t first_frame) {
  b.first_frame = first_frame;
  ++b.starts;
  // what parts from it keeps the frames that it had
  for (const auto& other : branches_) {
    if (other->parent != b.id || other->first_frame == 0) continue;
    other->first_frame = 0;
    ++other->starts;
    if (callbacks_.on_branch) callbacks_.on_branch(*other);
  }
}

Steering::Made Steering::fork(const std::string& name) {
  Branch& from = active();
  if (!from.run().has_begun() || from.run().moments().empty())
    throw InputError("E930", "the branch has no equilibrium to go on from");
  Branch b;
  b.name = name_of_new(name);
  b.parent = from.id;
  b.pieces = cut(from, cursor_);
  b.time = b.pieces.back().time;
  b.sample = from.sample;
  Made made;
  made.time = b.time;
  made.step = b.pieces.back().step;
  b.pieces.push_back({go_on(b.pieces, b.pieces.back().run->model_pointer(), false), 0, 0, 0});
  b.first_frame = count_shared(b);
  made.branch = &add_branch(std::move(b));
  made.text = fmt::format("branch \"{}\"", made.branch->name);
  return made;
}

Steering::Made Steering::undo() {
  Branch& from = active();
  if (from.edits.empty()) throw InputError("E934", "branch \"" + from.name + "\" has no edit to take back");
  const EditEntry entry = from.edits.back();
  const bool is_fresh = from.run().steps() == from.run().start_steps();
  Made made;
  made.text = "taken back: " + entry.text;
  made.time = entry.time;
  made.step = entry.before.back().step;
  if (entry.made_branch) {
    switch_to(entry.from);
    made.branch = &active();
    return made;
  }
  // one that it has from the branch that it came from was made on a run of that one
  if (is_fresh && entry.from == from.id && entry.before.back().run->steps() == entry.before.back().step) {
    const bool is_anew = from.pieces.front().run != entry.before.front().run;
    from.pieces = entry.before;
    from.edits.pop_back();
    const bool is_shared = from.parent > 0 && branch(from.parent).pieces.front().run == from.pieces.front().run;
    if (is_anew) start_anew(from, is_shared ? entry.first_frame : 0);
    go_live();
    watch(from);
    made.branch = &from;
    if (callbacks_.on_branch) callbacks_.on_branch(from);
    return made;
  }
  Branch b;
  b.name = name_of_new({});
  b.parent = from.id;
  b.time = entry.time;
  b.pieces = entry.before;
  b.edits.assign(from.edits.begin(), from.edits.end() - 1);
  b.sample = from.sample;
  b.pieces.push_back({go_on(b.pieces, b.pieces.back().run->model_pointer(), false), 0, 0, 0});
  b.first_frame = b.pieces.front().run == from.pieces.front().run ? count_shared(b) : 0;
  made.branch = &add_branch(std::move(b));
  return made;
}

std::unique_ptr<BranchRecord> Steering::copy_record(const Branch& b) const {
  return std::make_unique<BranchRecord>(b, k_, options_.run);
}

record::Record Steering::make_record(const Branch& b) const { return *copy_record(b)->finish(); }

}  // namespace topple::collapse
