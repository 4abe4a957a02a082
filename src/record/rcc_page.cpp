#include "record/rcc_page.h"

#include <fmt/format.h>

#include <cmath>

#include "base/unit.h"

namespace topple::record {

namespace {

constexpr const char* style = R"css(
*{box-sizing:border-box}
:root{--page:#eef1f4;--edge:#cfd6dd;--accent:#0b5a94}
@media screen and (prefers-color-scheme:dark){:root{--page:#0f1317;--edge:#36404a;--accent:#6cb6ee}}
body{margin:0 auto;max-width:1080px;padding:20px 18px 48px;background:var(--page);color:var(--ink-text);
 font:14px/1.45 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","Liberation Sans",Arial,sans-serif}
h1{font-size:22px;line-height:1.25;margin:0 0 2px;overflow-wrap:anywhere}
h2{font-size:17px;margin:28px 0 8px}
p{margin:6px 0}
.quiet{color:var(--ink-quiet)}
section,figure{background:var(--ink-panel);border:1px solid var(--edge);border-radius:6px;margin:0 0 14px;padding:12px 14px}
figcaption{margin:4px 0 6px}
.drawing text{font-family:inherit}
@media screen and (max-width:760px){.wide .drawing{min-width:800px}}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:13px}
th,td{padding:3px 9px;border-bottom:1px solid var(--ink-faint);text-align:right;white-space:nowrap}
th{color:var(--ink-quiet);font-weight:600;vertical-align:bottom}
th:first-child,td:first-child,td.words,th.words{text-align:left}
td.words{white-space:normal;min-width:14em}
.scroller{overflow:auto;max-height:420px}
.wide{overflow-x:auto}
summary{cursor:pointer;color:var(--accent)}
:focus-visible{outline:2px solid var(--accent);outline-offset:1px}
dl{display:grid;grid-template-columns:max-content 1fr;gap:2px 16px;margin:0}
dt{color:var(--ink-quiet)}dd{margin:0;overflow-wrap:anywhere}
.wide{margin:8px 0}
ul{margin:4px 0;padding-left:20px}
nav a{color:var(--accent);margin-right:14px}
@media print{
 body{max-width:none;padding:0;background:#fff;font-size:11px}
 figure,section{break-inside:avoid;border-color:#ccc}
 h2,h3{break-after:avoid}
 details:not([open]){display:none}nav{display:none}
 .scroller{max-height:none;overflow:visible}
 table{font-size:9px}th,td{padding:1px 4px}
}
)css";

std::string cell(double value, double unit, int digits = 4) { return shown(value, unit, digits); }

/// The table of stiffness and points, and how each curve ends.
std::string points_table(const RccReport& r) {
  std::string out =
      "<div class=\"wide\"><table><thead><tr><th rowspan=\"2\" class=\"words\">about</th><th rowspan=\"2\">N "
      "[MN]</th><th colspan=\"2\">stiffness EI [MNm²]</th><th colspan=\"2\">yield</th><th colspan=\"2\">peak</th><th "
      "colspan=\"2\">ultimate</th><th colspan=\"2\">residual</th></tr>\n<tr><th>uncracked</th><th>effective</th>";
  for (int i = 0; i < 4; ++i) out += "<th>φ [mrad]</th><th>M [kNm]</th>";
  out += "</tr></thead><tbody>\n";
  std::string endings =
      "<table><thead><tr><th>about</th><th>N [MN]</th><th class=\"words\">how the curve "
      "ends</th></tr></thead><tbody>\n";
  const bool two_routes = !r.curves.empty() && r.curves.front().route != r.curves.back().route;
  for (const auto& [curve, about] : group_curves(r)) {
    const RccCurve& c = *curve;
    const std::string head = fmt::format("<tr><td>{}{}</td><td>{}</td>", about, two_routes ? ", " + c.route : "",
                                         cell(c.normal_force, unit::MN));
    endings += fmt::format("{}<td class=\"words\">{}</td></tr>\n", head, escape_html(c.ending));
    if (!std::isfinite(c.peak.moment)) continue;
    out += head;
    out += fmt::format("<td>{}</td><td>{}</td>", cell(c.stiffness_uncracked, 1e6),
                       c.stiffness_effective > 0 ? cell(c.stiffness_effective, 1e6) : "-");
    for (const RccPoint& p : {c.yield, c.peak, c.ultimate, c.residual})
      out += fmt::format("<td>{}</td><td>{}</td>", cell(p.rotation, 1e-3), cell(p.moment, unit::kNm));
    out += "</tr>\n";
  }
  return out +
         "</tbody></table></div>\n<p class=\"quiet\">Yield: first of steel in tension, concrete at its peak "
         "strain, 0.75 of the peak. Ultimate: behind the peak, first of 0.8 of it, a torn bar, the loss of N. "
         "Residual: at twice that rotation, or at the end of the curve.</p>\n<div class=\"wide\">" +
         endings + "</tbody></table></div>\n";
}

std::string capacities(const RccReport& r) {
  std::string out = "<dl>";
  const auto add = [&out](const char* key, const std::string& value) {
    out += fmt::format("<dt>{}</dt><dd>{}</dd>\n", key, value);
  };
  add("Crushes without bending", cell(r.crushing_force, unit::MN) + " MN");
  add("Tears without bending", cell(r.rupture_force, unit::MN) + " MN of tension");
  add("Axial stiffness EA", cell(r.EA, unit::MN) + " MN");
  add("Shear capacity along y, along z", fmt::format("{}, {} kN, and {} of the compression", cell(r.shear_y, unit::kN),
                                                     cell(r.shear_z, unit::kN), cell(r.shear_friction, 1, 3)));
  add("Torsional capacity", cell(r.torsion, unit::kNm) + " kNm");
  return out + "</dl>\n";
}

}  // namespace

std::string page_head(const std::string& title) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n",
      escape_html(title), drawing_css(), style);
}

std::string table_html(const FigureTable& t) {
  std::string out = "<table><thead><tr>";
  for (const std::string& h : t.heads) out += fmt::format("<th scope=\"col\">{}</th>", escape_html(h));
  out += "</tr></thead><tbody>\n";
  for (const auto& row : t.rows) {
    out += "<tr>";
    for (const std::string& value : row) out += fmt::format("<td>{}</td>", escape_html(value));
    out += "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

std::string figures_html(const std::vector<Figure>& figures) {
  std::string out, heading;
  bool is_folded = false;
  for (const Figure& f : figures) {
    if (f.heading != heading) {
      if (is_folded) out += "</details>\n";
      heading = f.heading;
      is_folded = f.is_detail;
      out += is_folded ? fmt::format("<details><summary>{}</summary>\n", escape_html(heading))
                       : fmt::format("<h2>{}</h2>\n", escape_html(heading));
    }
    out += fmt::format("<figure id=\"{}\">\n<div class=\"wide\" tabindex=\"0\">{}</div>\n<figcaption>{}</figcaption>\n",
                       f.id, to_svg(f.drawing), escape_html(f.caption));
    if (!f.table.rows.empty())
      out += fmt::format(
          "<details><summary>Table of values</summary><div class=\"scroller\" tabindex=\"0\">{}</div></details>\n",
          table_html(f.table));
    out += "</figure>\n";
  }
  return is_folded ? out + "</details>\n" : out;
}

std::string list_html(const std::string& heading, const std::vector<std::string>& items) {
  if (items.empty()) return {};
  std::string out = fmt::format("<h2>{}</h2>\n<section><ul>\n", escape_html(heading));
  for (const std::string& item : items) out += fmt::format("<li>{}</li>\n", escape_html(item));
  return out + "</ul></section>\n";
}

std::string inputs_html(const std::vector<KeyValue>& inputs) {
  std::string out = "<h2>Input</h2>\n<section><dl>\n";
  for (const KeyValue& v : inputs)
    out += fmt::format("<dt>{}: {}</dt><dd>{}</dd>\n", escape_html(v.group), escape_html(v.key), escape_html(v.value));
  return out + "</dl></section>\n";
}

std::string provenance_html(const std::string& source, const std::string& sha256, const std::string& version) {
  return fmt::format(
      "<h2>Where this comes from</h2>\n<section><dl><dt>Program</dt><dd>topple {}</dd>\n<dt>Input "
      "file</dt><dd>{}</dd>\n<dt>SHA-256 of its bytes</dt><dd>{}</dd></dl></section>\n",
      escape_html(version), escape_html(source), escape_html(sha256));
}

std::string to_page(const RccReport& r, const std::vector<Figure>& figures) {
  std::string out = page_head(r.title);
  out += fmt::format(
      "<h1>{}</h1>\n<p class=\"quiet\">Resistance curves. {}. Normal forces are positive in compression, "
      "strains and stresses in tension.</p>\n",
      escape_html(r.title), escape_html(r.zone));
  for (const std::string& note : r.notes) out += fmt::format("<p>{}</p>\n", escape_html(note));
  out += "<h2>Stiffness and resistance</h2>\n<section>" + points_table(r) + capacities(r) + "</section>\n";
  out += figures_html(figures);
  out += list_html("The solid route's runs", r.solid_notes);
  out += inputs_html(r.inputs);
  out += list_html("Not modelled", r.not_modelled);
  out += provenance_html(r.source, r.sha256, r.program_version);
  return out + "</body>\n</html>\n";
}

}  // namespace topple::record
