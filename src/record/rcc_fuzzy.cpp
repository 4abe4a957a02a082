#include "record/rcc_fuzzy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/unit.h"
#include "record/plot.h"
#include "record/rcc_numbers.h"
#include "record/rcc_page.h"

namespace topple::record {

namespace {

using json = nlohmann::ordered_json;

constexpr double mrad = 1e-3;

json to_json(const RccInterval& i) {
  return {{"alpha", i.alpha}, {"left", number(i.left)}, {"right", number(i.right)}};
}

json to_json(const RccFuzzyReport& r, const RccFan& f) {
  json j;
  j["normal_force"] = f.normal_force;
  j["rotation"] = numbers(f.rotation);
  j["core"] = numbers(f.originals[static_cast<size_t>(f.core)].moment);
  j["levels"] = json::array();
  for (const RccFan::Level& l : f.levels)
    j["levels"].push_back({{"alpha", l.alpha}, {"lower", numbers(l.low)}, {"upper", numbers(l.high)}});
  j["ordinates"] = json::array();
  for (const RccOrdinate& o : f.ordinates) {
    json one{{"name", o.name}, {"rotation", o.rotation < 0 ? json(nullptr) : number(o.rotation)}};
    one["cuts"] = json::array();
    for (const RccInterval& i : o.cuts) one["cuts"].push_back(to_json(i));
    j["ordinates"].push_back(std::move(one));
  }
  j["outcomes"] = json::array();
  for (const RccOutcome& o : f.outcomes)
    j["outcomes"].push_back(
        {{"name", o.name}, {"runs", o.count}, {"possibility", number(o.possibility)}, {"sample", o.sample}});
  j["turned_to"] = number(f.rotation.back());
  j["crushing_possibility"] = number(f.crushing_possibility);
  j["tearing_possibility"] = number(f.tearing_possibility);
  j["runs"] = f.originals.size();
  j["failed"] = f.failed;
  j["ending"] = f.ending;
  j["originals"] = json::array();
  for (const RccOriginal& o : f.originals) {
    if (!o.is_drawn) continue;
    json values;
    for (size_t i = 0; i < o.values.size(); ++i) values[r.inputs[i].path] = number(o.values[i]);
    j["originals"].push_back({{"sample", o.sample},
                              {"membership", number(o.membership)},
                              {"values", std::move(values)},
                              {"outcome", o.outcome},
                              {"moment", numbers(o.moment)}});
  }
  return j;
}

std::string force_text(double N) { return fmt::format("{} MN", shown(N, unit::MN)); }

std::string possibility_text(double p) { return p > 0 && p < 1e-3 ? "below 0.001" : shown(p, 1, 2); }

std::string values_text(const RccFuzzyReport& r, const RccOriginal& o) {
  std::string out;
  for (size_t i = 0; i < r.inputs.size(); ++i)
    if (!r.inputs[i].corners.empty())
      out += fmt::format("{}{} = {}{}{}", out.empty() ? "" : ", ", r.inputs[i].name,
                         shown(o.values[i], r.inputs[i].unit, 3), r.inputs[i].symbol.empty() ? "" : " ",
                         r.inputs[i].symbol);
  return out;
}

/// Bands from the outside inwards, each drawn over the last one, so that colours add up.
Figure make_fan(const RccFuzzyReport& r, const RccFan& f, size_t k) {
  Plot p;
  p.title = fmt::format("Fuzzy moment over rotation about {}{}, N = {}", sign_of(r.direction), r.axis,
                        force_text(f.normal_force));
  p.x_title = "rotation φ of the zone [mrad]";
  p.y_title = fmt::format("moment M about {} [kNm]", r.axis);
  p.height = 540;
  std::vector<double> x;
  for (const double phi : f.rotation) x.push_back(phi / mrad);
  p.x_high = x.back();
  Figure out;
  out.table.heads.push_back("φ [mrad]");
  constexpr double opacity = 0.16;
  double through = 1;
  double top = 0;
  std::vector<const RccFan::Level*> shown_levels;
  for (const RccFan::Level& l : f.levels) {
    PlotBand b;
    through *= 1 - opacity;
    b.name = fmt::format("α = {:g}", l.alpha);
    b.x = x, b.opacity = opacity, b.legend_opacity = 1 - through;
    bool is_wide = false;
    for (size_t j = 0; j < x.size(); ++j) {
      b.low.push_back(l.low[j] / unit::kNm), b.high.push_back(l.high[j] / unit::kNm);
      top = std::max(top, b.high.back());
      is_wide = is_wide || l.high[j] > l.low[j];
    }
    out.table.heads.push_back(fmt::format("α = {:g}: lower [kNm]", l.alpha));
    out.table.heads.push_back(fmt::format("α = {:g}: upper [kNm]", l.alpha));
    shown_levels.push_back(&l);
    if (is_wide) p.bands.push_back(std::move(b));
  }
  p.y_high = 1.06 * top;
  for (const bool loses : {false, true}) {
    bool is_first = true;
    for (const RccOriginal& o : f.originals) {
      if (!o.is_drawn || o.moment.empty() || o.sample == f.core) continue;
      size_t end = o.moment.size();
      while (end > 1 && o.moment[end - 1] == 0) --end;
      const bool is_lost = end < o.moment.size();
      if (is_lost != loses) continue;
      PlotLine line;
      line.ink = loses ? Ink::Series1 : Ink::Text, line.width = 1, line.opacity = loses ? 0.7 : 0.4;
      if (loses) line.dash = {4, 2};
      for (size_t j = 0; j < std::min(end + 1, o.moment.size()); ++j)
        line.x.push_back(x[j]), line.y.push_back(o.moment[j] / unit::kNm);
      if (is_first) line.name = loses ? "original that ends" : "original curve";
      is_first = false;
      if (loses && end > 1) p.marks.push_back({"end", line.x.back(), 0, Mark::Cross, Ink::Series1});
      p.lines.push_back(std::move(line));
    }
  }
  const RccOriginal& core = f.originals[static_cast<size_t>(f.core)];
  PlotLine line;
  line.name = "core (α = 1)", line.ink = Ink::Series0, line.width = 3;
  for (size_t j = 0; j < x.size() && j < core.moment.size(); ++j)
    line.x.push_back(x[j]), line.y.push_back(core.moment[j] / unit::kNm);
  p.lines.push_back(std::move(line));
  for (size_t j = 0; j < x.size(); j += 3) {
    std::vector<std::string> row{fmt::format("{:.4g}", x[j])};
    for (const RccFan::Level* l : shown_levels)
      row.push_back(shown(l->low[j], unit::kNm)), row.push_back(shown(l->high[j], unit::kNm));
    out.table.rows.push_back(std::move(row));
  }
  out.id = fmt::format("fan_{}", k + 1);
  out.heading = fmt::format("N = {}", force_text(f.normal_force));
  out.caption = fmt::format(
      "Every point between the bounds of a level is possible to at least the degree α. Each thin line is the curve of "
      "one "
      "set of inputs on the {} route; {} runs in all, the drawn ones hold a bound or fill the space evenly. The bounds "
      "are no curves: "
      "they change from one set of inputs to another on the way.",
      r.route, f.originals.size());
  out.drawing = draw(p);
  return out;
}

/// Largest moments over the input that decides most, with what became of the force.
Figure make_scatter(const RccFuzzyReport& r, const RccFan& f, size_t k) {
  size_t input = 0;
  for (size_t i = 0; i < r.inputs.size(); ++i)
    if (r.inputs[i].path == "concrete.fc" && !r.inputs[i].corners.empty()) input = i;
  const RccFuzzyInput& in = r.inputs[input];
  Plot p;
  p.title = fmt::format("Where the section stops carrying N = {}", force_text(f.normal_force));
  p.x_title = fmt::format("{}{}", in.name, in.symbol.empty() ? "" : fmt::format(" [{}]", in.symbol));
  p.y_title = "largest moment [kNm]";
  p.x_low = in.corners.front().first / in.unit, p.x_high = in.corners.back().first / in.unit;
  const double air = 0.03 * (p.x_high - p.x_low);
  p.x_low -= air, p.x_high += air;
  Figure out;
  out.table.heads = {p.x_title, "largest moment [kNm]", "membership", "outcome"};
  constexpr size_t most = 600;
  const size_t stride = 1 + f.originals.size() / most;
  double top = 0;
  for (size_t i = 0; i < f.originals.size(); i += stride) {
    const RccOriginal& o = f.originals[i];
    if (o.outcome == "failed") continue;
    const bool carries = o.outcome == f.outcomes.front().name;
    const bool is_crushed = o.outcome == f.outcomes.back().name;
    const bool is_force = o.outcome.rfind("loses the force", 0) == 0;
    p.marks.push_back({o.outcome, o.values[input] / in.unit, o.peak / unit::kNm,
                       carries      ? Mark::Circle
                       : is_crushed ? Mark::Cross
                       : is_force   ? Mark::Triangle
                                    : Mark::Square,
                       carries      ? Ink::Series0
                       : is_crushed ? Ink::Crushed
                       : is_force   ? Ink::Series1
                                    : Ink::Series4});
    top = std::max(top, o.peak / unit::kNm);
    out.table.rows.push_back(
        {shown(o.values[input], in.unit), shown(o.peak, unit::kNm), shown(o.membership, 1, 3), o.outcome});
  }
  p.y_low = -0.04 * top, p.y_high = 1.06 * top;
  if (!(top > 0)) p.y_low = p.y_high = 0;
  out.id = fmt::format("switch_{}", k + 1);
  out.heading = fmt::format("N = {}", force_text(f.normal_force));
  for (const std::string& sentence : describe_switch(r, f)) out.caption += (out.caption.empty() ? "" : " ") + sentence;
  out.drawing = draw(p);
  return out;
}

Figure make_crushing(const RccFuzzyReport& r) {
  Plot p;
  p.title = "Force that crushes the section without bending";
  p.x_title = "crushing force [MN]", p.y_title = "membership μ";
  p.y_low = 0, p.y_high = 1.08;
  PlotLine line;
  line.name = "crushing force", line.ink = Ink::Series0, line.width = 2.5;
  Figure out;
  out.table.heads = {"α", "left [MN]", "right [MN]"};
  for (const RccInterval& i : r.crushing) {
    line.x.push_back(i.left / unit::MN), line.y.push_back(i.alpha);
    out.table.rows.push_back({fmt::format("{:g}", i.alpha), shown(i.left, unit::MN), shown(i.right, unit::MN)});
  }
  for (size_t i = r.crushing.size(); i-- > 0;)
    line.x.push_back(r.crushing[i].right / unit::MN), line.y.push_back(r.crushing[i].alpha);
  p.x_low = 0, p.x_high = 1.05 * *std::max_element(line.x.begin(), line.x.end());
  p.lines.push_back(std::move(line));
  if (!r.tearing.empty()) {
    p.title = "Force that crushes or tears the section without bending";
    p.x_title = "force [MN], compression positive";
    p.x_low = -1.05 * r.tearing.front().right / unit::MN;
    PlotLine torn;
    torn.name = "tearing force", torn.ink = Ink::Series0, torn.width = 2.5, torn.dash = {9, 4};
    for (const RccInterval& i : r.tearing) {
      torn.x.push_back(-i.right / unit::MN), torn.y.push_back(i.alpha);
      out.table.rows.push_back({fmt::format("{:g}", i.alpha), shown(-i.right, unit::MN), shown(-i.left, unit::MN)});
    }
    for (size_t i = r.tearing.size(); i-- > 0;)
      torn.x.push_back(-r.tearing[i].left / unit::MN), torn.y.push_back(r.tearing[i].alpha);
    p.lines.push_back(std::move(torn));
  }
  for (size_t k = 0; k < r.fans.size(); ++k) {
    const RccFan& f = r.fans[k];
    PlotLine at;
    at.name = fmt::format("N = {}: Π = {}", force_text(f.normal_force),
                          possibility_text(std::max(f.crushing_possibility, f.tearing_possibility)));
    p.x_low = std::min(p.x_low, 1.05 * f.normal_force / unit::MN);
    at.x = {f.normal_force / unit::MN, f.normal_force / unit::MN}, at.y = {0, 1.08};
    at.ink = series_ink(k + 1), at.dash = dash_of(k + 1);
    p.lines.push_back(std::move(at));
    p.marks.push_back({r.tearing.empty() ? "possibility that N crushes it" : "possibility that N crushes or tears it",
                       f.normal_force / unit::MN, std::max(f.crushing_possibility, f.tearing_possibility), Mark::Circle,
                       series_ink(k + 1)});
  }
  out.id = "crushing";
  out.heading = "Can the section carry the force at all?";
  out.caption =
      "Membership of the force that crushes the section without any bending, and the applied forces. Π is the "
      "possibility "
      "that the crushing force is not larger than N: then there is no curve at all, the zone is crushed.";
  out.drawing = draw(p);
  return out;
}

Figure make_inputs(const RccFuzzyReport& r) {
  Plot p;
  p.title = "Fuzzy inputs over their core values";
  p.x_title = "value / core value", p.y_title = "membership μ";
  p.y_low = 0, p.y_high = 1.08;
  p.height = 380;
  double low = 1, high = 1;
  Figure out;
  out.table.heads = {"input", "unit", "value", "membership"};
  size_t k = 0;
  for (const RccFuzzyInput& in : r.inputs) {
    if (in.corners.empty()) {
      out.table.rows.push_back({in.path, in.symbol, in.formula, "by the formula"});
      continue;
    }
    double core = 0;
    for (const auto& [x, mu] : in.corners)
      if (mu == 1) core = x;
    PlotLine line;
    line.name = in.path, line.ink = series_ink(k);
    if (k % 4 == 1) line.dash = {9, 4};
    if (k % 4 == 2) line.dash = {2, 3};
    if (k % 4 == 3) line.dash = {12, 3, 2, 3};
    for (const auto& [x, mu] : in.corners) {
      const double share = core != 0 ? x / core : x;
      line.x.push_back(share), line.y.push_back(mu);
      low = std::min(low, share), high = std::max(high, share);
      out.table.rows.push_back({in.path, in.symbol, shown(x, in.unit), shown(mu, 1)});
    }
    p.lines.push_back(std::move(line));
    ++k;
  }
  for (const std::string& c : r.constraints) out.table.rows.push_back({"interaction", "", c, "a constraint"});
  if (!r.joint.empty()) out.table.rows.push_back({"interaction", "", r.joint, "of all together"});
  p.x_low = low - 0.05 * (high - low), p.x_high = high + 0.05 * (high - low);
  out.id = "inputs";
  out.heading = "Fuzzy inputs";
  out.caption =
      "What is possible, and to which degree. Values that follow by a formula, and what ties values together, are in "
      "the table.";
  out.drawing = draw(p);
  return out;
}

std::string outcomes_html(const RccFuzzyReport& r) {
  std::string out =
      "<div class=\"wide\"><table><thead><tr><th>N [MN]</th><th>turned to [mrad]</th><th "
      "class=\"words\">outcome</th><th>possibility "
      "Π</th><th>runs</th><th class=\"words\">most possible inputs</th></tr></thead><tbody>\n";
  for (const RccFan& f : r.fans)
    for (const RccOutcome& o : f.outcomes)
      out += fmt::format(
          "<tr><td>{}</td><td>{}</td><td class=\"words\">{}</td><td>{}</td><td>{}</td><td "
          "class=\"words\">{}</td></tr>\n",
          shown(f.normal_force, unit::MN), shown(f.rotation.back(), mrad), escape_html(o.name),
          possibility_text(o.possibility), o.count,
          o.sample >= 0 ? escape_html(values_text(r, f.originals[static_cast<size_t>(o.sample)])) : "");
  return out + "</tbody></table></div>\n";
}

std::string ordinates_html(const RccFuzzyReport& r) {
  std::string out = "<div class=\"wide\"><table><thead><tr><th>N [MN]</th><th>of</th>";
  if (r.fans.empty() || r.fans.front().ordinates.empty()) return {};
  for (const RccInterval& i : r.fans.front().ordinates.front().cuts)
    out += fmt::format("<th>α = {:g} [kNm]</th>", i.alpha);
  out += "</tr></thead><tbody>\n";
  for (const RccFan& f : r.fans)
    for (const RccOrdinate& o : f.ordinates) {
      out += fmt::format("<tr><td>{}</td><td>{}</td>", shown(f.normal_force, unit::MN), escape_html(o.name));
      for (const RccInterval& i : o.cuts)
        out += fmt::format("<td>{} to {}</td>", shown(i.left, unit::kNm), shown(i.right, unit::kNm));
      out += "</tr>\n";
    }
  return out + "</tbody></table></div>\n";
}

}  // namespace

std::vector<std::string> describe_switch(const RccFuzzyReport& r, const RccFan& f) {
  std::vector<std::string> out;
  const std::string N = force_text(f.normal_force), to = fmt::format("{} mrad", shown(f.rotation.back(), mrad));
  const auto say = [&](const RccOutcome& o) {
    if (&o == &f.outcomes.back()) return "is " + o.name;
    return fmt::format("{} {}{}", o.name, &o == &f.outcomes.front() ? "up to " : "to ", to);
  };
  const RccOutcome* core = nullptr;
  for (const RccOutcome& o : f.outcomes)
    if (o.name == f.originals[static_cast<size_t>(f.core)].outcome) core = &o;
  if (core) out.push_back(fmt::format("With the core values the section under {} {}.", N, say(*core)));
  const bool is_pulled = f.normal_force < 0;
  const double alone = is_pulled ? f.tearing_possibility : f.crushing_possibility;
  if (alone > 0) {
    out.push_back(
        fmt::format("To the possibility {} it is {} by the force alone, without any rotation: then the zone {}.",
                    possibility_text(alone), is_pulled ? "torn" : "crushed",
                    is_pulled ? "comes apart" : "gives way downwards instead of turning"));
  } else {
    out.push_back(fmt::format("No set of inputs lets the force {} it without rotation.", is_pulled ? "tear" : "crush"));
  }
  for (const RccOutcome& o : f.outcomes)
    if (o.name.rfind("loses", 0) == 0 && o.possibility > 0 && o.sample >= 0)
      out.push_back(fmt::format("To the possibility {} it {}, most possibly at {}.", possibility_text(o.possibility),
                                say(o), values_text(r, f.originals[static_cast<size_t>(o.sample)])));
  out.push_back(fmt::format("All this holds for a zone that is turned to {}{}; beyond, more of the runs may give way.",
                            to, f.window.empty() ? "" : " (" + f.window + ")"));
  return out;
}

std::string to_json(const RccFuzzyReport& r) {
  json j;
  j["format"] = "topple-rcc-fuzzy";
  j["version"] = 1;
  j["title"] = r.title;
  j["provenance"] = {{"source", r.source},
                     {"sha256", r.sha256},
                     {"inputs", r.inputs_source},
                     {"inputs_sha256", r.inputs_sha256},
                     {"program_version", r.program_version},
                     {"seed", r.seed}};
  j["route"] = r.route;
  j["axis"] = std::string(1, r.axis);
  j["direction"] = sign_of(r.direction);
  j["inputs"] = json::array();
  for (const RccFuzzyInput& in : r.inputs) {
    json one{{"path", in.path}};
    if (in.corners.empty()) {
      one["formula"] = in.formula;
    } else {
      one["corners"] = json::array();
      for (const auto& [x, mu] : in.corners) one["corners"].push_back({number(x), number(mu)});
    }
    j["inputs"].push_back(std::move(one));
  }
  if (!r.constraints.empty() || !r.joint.empty())
    j["interaction"] = {{"constraints", r.constraints}, {"membership", r.joint}};
  j["crushing_force"] = json::array();
  for (const RccInterval& i : r.crushing) j["crushing_force"].push_back(to_json(i));
  j["tearing_force"] = json::array();
  for (const RccInterval& i : r.tearing) j["tearing_force"].push_back(to_json(i));
  j["fans"] = json::array();
  for (const RccFan& f : r.fans) j["fans"].push_back(to_json(r, f));
  j["notes"] = r.notes;
  j["not_modelled"] = r.not_modelled;
  return j.dump(1, ' ', false, json::error_handler_t::replace);
}

std::string fan_csv(const RccFuzzyReport& r) {
  std::string out = "axis,direction,normal force [N],alpha,rotation [rad],lower moment [N·m],upper moment [N·m]";
  out += line_end;
  for (const RccFan& f : r.fans)
    for (const RccFan::Level& l : f.levels)
      for (size_t j = 0; j < f.rotation.size(); ++j)
        out += fmt::format("{},{},{},{},{},{},{}{}", r.axis, sign_of(r.direction), digits(f.normal_force),
                           digits(l.alpha), digits(f.rotation[j]), digits(l.low[j]), digits(l.high[j]), line_end);
  return out;
}

std::string samples_csv(const RccFuzzyReport& r) {
  std::string out = "normal force [N],sample,membership";
  for (const RccFuzzyInput& in : r.inputs) out += "," + in.path + " [SI]";
  out += ",outcome,largest moment [N·m]";
  out += line_end;
  for (const RccFan& f : r.fans)
    for (const RccOriginal& o : f.originals) {
      out += fmt::format("{},{},{}", digits(f.normal_force), o.sample, digits(o.membership));
      for (const double v : o.values) out += "," + digits(v);
      for (size_t i = o.values.size(); i < r.inputs.size(); ++i) out += ",";
      out += fmt::format(",{},{}{}", o.outcome, digits(o.peak), line_end);
    }
  return out;
}

std::string originals_csv(const RccFuzzyReport& r) {
  std::string out = "normal force [N],sample,rotation [rad],moment [N·m]";
  out += line_end;
  for (const RccFan& f : r.fans)
    for (const RccOriginal& o : f.originals) {
      if (!o.is_drawn) continue;
      for (size_t j = 0; j < o.moment.size(); ++j)
        out += fmt::format("{},{},{},{}{}", digits(f.normal_force), o.sample, digits(f.rotation[j]),
                           digits(o.moment[j]), line_end);
    }
  return out;
}

std::vector<Figure> make_figures(const RccFuzzyReport& r) {
  std::vector<Figure> out;
  out.push_back(make_crushing(r));
  for (size_t k = 0; k < r.fans.size(); ++k) {
    out.push_back(make_fan(r, r.fans[k], k));
    out.push_back(make_scatter(r, r.fans[k], k));
  }
  out.push_back(make_inputs(r));
  return out;
}

std::string to_page(const RccFuzzyReport& r, const std::vector<Figure>& figures) {
  std::string out = page_head(r.title);
  out += fmt::format(
      "<h1>{}</h1>\n<p class=\"quiet\">Fuzzy resistance curves about {}{}, every one of them on the {} route. {}. "
      "Normal "
      "forces are positive in compression.</p>\n",
      escape_html(r.title), sign_of(r.direction), r.axis, escape_html(r.route), escape_html(r.zone));
  for (const std::string& note : r.notes) out += fmt::format("<p>{}</p>\n", escape_html(note));
  out += "<h2>What can happen</h2>\n<section>";
  for (const RccFan& f : r.fans) {
    out += fmt::format("<p><b>N = {}.</b>", force_text(f.normal_force));
    for (const std::string& s : describe_switch(r, f)) out += " " + escape_html(s);
    out += "</p>\n";
  }
  out += outcomes_html(r) +
         "<p class=\"quiet\">Possibilities are searched for among the runs, so they are lower bounds.</p></section>\n";
  out += figures_html(figures);
  out += "<h2>Bounds that were searched for</h2>\n<section>" + ordinates_html(r);
  for (const RccFan& f : r.fans)
    out += fmt::format("<p class=\"quiet\">N = {}: {} runs, {} failed{}. {}</p>\n", force_text(f.normal_force),
                       f.originals.size(), f.failed, f.failure.empty() ? "" : " (" + escape_html(f.failure) + ")",
                       escape_html(f.ending));
  out += "<p class=\"quiet\">Between these rotations the fan is made of all runs and is an inner estimate.</p>\n";
  out += "</section>\n";
  out += inputs_html(r.section);
  out += list_html("Not modelled", r.not_modelled);
  out += provenance_html(r.source, r.sha256, r.program_version);
  out += fmt::format("<p class=\"quiet\">Fuzzy inputs: {}, SHA-256 {}; seed {}.</p>\n", escape_html(r.inputs_source),
                     escape_html(r.inputs_sha256), r.seed);
  return out + "</body>\n</html>\n";
}

}  // namespace topple::record
