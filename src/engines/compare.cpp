#include "engines/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engines/course.h"

namespace topple::engines {

namespace {

/// What is kept of a frame.
struct Frame {
  double time = 0;
  std::vector<Pose> X_WB;
  double height = 0;  // of the centre of all moving mass against gravity [m]
};

double calc_height(const mbs::Model& model, const mbs::View& v) {
  const double g = norm(model.gravity);
  const Vec3 up = g > 0 ? (-1 / g) * model.gravity : Vec3{0, 0, 1};
  double mass = 0, moment = 0;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (model.bodies[b].fixed) continue;
    mass += v.mass[b];
    moment += v.mass[b] * dot(up, v.X_WB[b].p);
  }
  return mass > 0 ? moment / mass : 0;
}

bool counts_as_broken(mbs::Happening::Kind k) {
  using Kind = mbs::Happening::Kind;
  return k == Kind::ElementBroken || k == Kind::JointReleased || k == Kind::CableBroken || k == Kind::SpringBroken ||
         k == Kind::RotationalSpringBroken || k == Kind::BushingBroken;
}

void grow(Difference& largest, double value, int body, double time) {
  if (value > largest.value) largest = {value, body, time};
}

/// Adds one instant of a run against the first engine's.
void add_instant(const mbs::Model& model, const Frame& first, const Frame& frame, EngineRun& run) {
  Difference p, q;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (model.bodies[b].fixed) continue;
    const double apart = norm(frame.X_WB[b].p - first.X_WB[b].p);
    const double turned = norm(log_rotation(conjugate(first.X_WB[b].q) * frame.X_WB[b].q));
    const int body = static_cast<int>(b);
    grow(p, apart, body, frame.time);
    grow(q, turned, body, frame.time);
    grow(run.body_position[b], apart, body, frame.time);
    grow(run.body_orientation[b], turned, body, frame.time);
  }
  grow(run.position, p.value, p.body, frame.time);
  grow(run.orientation, q.value, q.body, frame.time);
  const double height = frame.height - first.height;
  grow(run.height, std::abs(height), 0, frame.time);
  run.time.push_back(frame.time);
  run.position_at.push_back(p.value);
  run.orientation_at.push_back(q.value);
  run.height_at.push_back(height);
  run.position_body.push_back(p.body);
  run.orientation_body.push_back(q.body);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? std::string("&lt;") : c == '&' ? std::string("&amp;") : c == '>' ? "&gt;" : std::string(1, c);
  return out;
}

/// All engines with steps of options.step.
std::vector<EngineRun> run_all(const mbs::Model& model, const mbs::Options& options,
                               const std::vector<std::unique_ptr<Engine>>& engines,
                               const std::function<void(const std::string&)>& report) {
  std::vector<EngineRun> runs;
  std::vector<Frame> first;
  bool has_first = false;
  for (const auto& engine : engines) {
    EngineRun run;
    run.name = engine->name();
    run.version = engine->version();
    run.unsupported = engine->find_unsupported(model, options);
    if (run.has_run()) {
      if (report) report(run.name);
      run.body_position.resize(model.bodies.size());
      run.body_orientation.resize(model.bodies.size());
      mbs::Options o = options;
      size_t at = 0;
      o.on_happening = [&](const mbs::Happening& h) { run.broken += counts_as_broken(h.kind); };
      o.on_frame = [&](const mbs::View& v) {
        Frame frame{v.time, v.X_WB, calc_height(model, v)};
        if (!has_first) return first.push_back(std::move(frame));
        // runs that end early lack instants, or have an odd one at their end
        while (at < first.size() && first[at].time < v.time - 0.25 * options.frame_interval) ++at;
        if (at < first.size() && std::abs(first[at].time - v.time) <= 1e-6 * options.frame_interval)
          add_instant(model, first[at], frame, run);
      };
      run.summary = engine->run(model, o);
      has_first = true;
    }
    runs.push_back(std::move(run));
    if (options.progress.is_cancelled()) break;
  }
  return runs;
}

/// The step that the stiffest mode on the way asks for.
double calc_wanted_step(const std::vector<EngineRun>& runs, const mbs::Options& options) {
  double fastest = 0;
  for (const EngineRun& r : runs) fastest = std::max(fastest, r.summary.highest_frequency);
  return fastest > 0 ? 2 * options.step_safety / fastest : options.step;
}

}  // namespace

Comparison compare(const mbs::Model& model, mbs::Options options, const std::vector<std::unique_ptr<Engine>>& engines,
                   const std::function<void(const std::string&)>& report) {
  mbs::check_model(model);
  Comparison out;
  const bool is_step_given = options.step > 0;
  options = make_silent(options);
  options.tells_lost_contact = true;
  out.interval = options.frame_interval;
  double wanted = choose_step(model, options);
  constexpr int most_rounds = 4;
  for (int round = 0; round < most_rounds; ++round) {
    // every engine shall show the same instants: a whole number of steps between them
    options.step = out.interval / std::ceil(out.interval / std::min(wanted, out.interval) * (1 - 1e-9));
    out.step = options.step;
    out.runs = run_all(model, options, engines, report);
    // events may leave something stiffer than it was at the start
    wanted = calc_wanted_step(out.runs, options);
    if (is_step_given || options.progress.is_cancelled() || options.step <= 1.05 * wanted) break;
  }
  return out;
}

std::string to_csv(const mbs::Model& model, const Comparison& c) {
  std::string out =
      "engine,time [s],position [m],body of position,orientation [rad],body of orientation,height [m]\r\n";
  const auto name_of = [&](int body) {
    return body < 0 ? std::string() : quoted(model.bodies[static_cast<size_t>(body)].name);
  };
  for (const EngineRun& r : c.runs)
    for (size_t i = 0; i < r.time.size(); ++i)
      out += fmt::format("{},{},{},{},{},{},{}\r\n", r.name, r.time[i], r.position_at[i] + 0.0,
                         name_of(r.position_body[i]), r.orientation_at[i] + 0.0, name_of(r.orientation_body[i]),
                         r.height_at[i] + 0.0);
  return out;
}

std::string to_svg(const mbs::Model& model, const Comparison& c) {
  constexpr double width = 720, height = 400, left = 70, right = 130, top = 40, bottom = 50;
  static const char* const colours[] = {"#0b6e99", "#b3541e", "#4f7a28", "#7a3e9d"};
  double low = 1e300, high = 0, last = 0;
  std::string against;
  for (const EngineRun& r : c.runs) {
    if (r.has_run() && against.empty()) against = r.name;
    for (size_t i = 0; i < r.time.size(); ++i) {
      if (!(r.position_at[i] > 0) || !std::isfinite(r.position_at[i])) continue;
      low = std::min(low, r.position_at[i]);
      high = std::max(high, r.position_at[i]);
      last = std::max(last, r.time[i]);
    }
  }
  if (!(high > 0) || !(last > 0)) return {};
  const double bottom_decade = std::max(std::floor(std::log10(low)), -16.0);
  const double top_decade = std::max(std::ceil(std::log10(high)), bottom_decade + 1);
  const auto x_of = [&](double t) { return left + (width - left - right) * t / last; };
  const auto y_of = [&](double d) {
    return height - bottom - (height - top - bottom) * (std::log10(d) - bottom_decade) / (top_decade - bottom_decade);
  };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:g} {:g}\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<text x=\"{:g}\" y=\"22\" font-size=\"14\">{}: largest difference in position from {} [m]</text>\n",
      width, height, left, escaped(model.name.empty() ? "model" : model.name), escaped(against));
  const double every = std::max(1.0, std::ceil((top_decade - bottom_decade) / 10));
  for (double d = bottom_decade; d <= top_decade; d += every) {
    const double y = y_of(std::pow(10, d));
    out += fmt::format(
        "<line x1=\"{:g}\" y1=\"{:.1f}\" x2=\"{:g}\" y2=\"{:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{:g}\" y=\"{:.1f}\" text-anchor=\"end\">1e{:g}</text>\n",
        left, y, width - right, y, left - 8, y + 4, d);
  }
  for (int i = 0; i <= 4; ++i)
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:g}\" text-anchor=\"middle\">{:.3g}</text>\n", x_of(last * i / 4),
                       height - bottom + 18, last * i / 4);
  out += fmt::format("<text x=\"{:g}\" y=\"{:g}\" text-anchor=\"middle\">time [s]</text>\n",
                     0.5 * (left + width - right), height - 12);
  int number = 0;
  for (const EngineRun& r : c.runs) {
    if (r.time.empty()) continue;
    const char* colour = colours[number % 4];
    std::string points;
    for (size_t i = 0; i < r.time.size(); ++i)
      if (r.position_at[i] > 0 && std::isfinite(r.position_at[i]))
        points += fmt::format("{:.1f},{:.1f} ", x_of(r.time[i]), y_of(std::max(r.position_at[i], 1e-16)));
    out += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{}/>\n", points, colour,
                       number == 0 ? "" : fmt::format(" stroke-dasharray=\"{} 4\"", 4 * number));
    out += fmt::format("<text x=\"{:g}\" y=\"{:g}\" fill=\"{}\">{}</text>\n", width - right + 12,
                       top + 12 + 18 * number, colour, escaped(r.name));
    ++number;
  }
  return out + "</svg>\n";
}

}  // namespace topple::engines
