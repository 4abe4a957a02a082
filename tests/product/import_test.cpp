#include "product/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "base/file.h"
#include "product/plan.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// Writes an IFC file entity by entity.
class IfcWriter {
 public:
  IfcWriter(std::string schema, double unit, double angle)
      : schema_(std::move(schema)), unit_(unit), c_(std::cos(angle)), s_(std::sin(angle)) {
    add(unit_ == 1e-3 ? "IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.)" : "IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)");
    add("IFCUNITASSIGNMENT((#" + std::to_string(last_) + "))");
    add("IFCBUILDING('g',$,'Halle \\X2\\00C4\\X0\\ ''Nord''',$,$,$,$,$,.ELEMENT.,$,$,$)");
  }
  int add(const std::string& text) {
    body_ += "#" + std::to_string(++last_) + "= " + text + ";\n";
    return last_;
  }
  std::string number(double metres) const { return std::to_string(metres / unit_); }
  std::string ref(int id) const { return "#" + std::to_string(id); }

  /// Placed at a point, local x in the direction of the (turned) angle, local z up unless given.
  int placement(double x, double y, double z, const std::string& axis = "$", const std::string& ref_direction = "") {
    const int p = point(x, y, z);
    std::string d = ref_direction;
    if (d.empty()) d = ref(add("IFCDIRECTION((" + std::to_string(c_) + "," + std::to_string(s_) + ",0.))"));
    const int a = add("IFCAXIS2PLACEMENT3D(" + ref(p) + "," + axis + "," + d + ")");
    return add("IFCLOCALPLACEMENT($," + ref(a) + ")");
  }
  int point(double x, double y, double z) {
    return add("IFCCARTESIANPOINT((" + number(c_ * x - s_ * y) + "," + number(s_ * x + c_ * y) + "," + number(z) +
               "))");
  }
  /// An upright block of w x h x depth, centred on its place.
  int shape(double w, double h, double depth) {
    const int profile = add("IFCRECTANGLEPROFILEDEF(.AREA.,$,$," + number(w) + "," + number(h) + ")");
    return extrusion(profile, depth);
  }
  int extrusion(int profile, double depth) {
    const int up = add("IFCDIRECTION((0.,0.,1.))");
    const int solid = add("IFCEXTRUDEDAREASOLID(" + ref(profile) + ",$," + ref(up) + "," + number(depth) + ")");
    return definition("SweptSolid", solid);
  }
  int definition(const std::string& type, int item) {
    const int r = add("IFCSHAPEREPRESENTATION($,'Body','" + type + "',(" + ref(item) + "))");
    return add("IFCPRODUCTDEFINITIONSHAPE($,$,(" + ref(r) + "))");
  }
  void storey(const std::string& name, double z) {
    add("IFCBUILDINGSTOREY('g',$,'" + name + "',$,$,$,$,$,.ELEMENT.," + number(z) + ")");
  }
  int element(const std::string& type, int place, int shape, const std::string& more = "$") {
    return add(type + "('g',$,'" + type + "',$,$," + ref(place) + "," + ref(shape) + "," + more + ")");
  }
  void material(const std::string& name, const std::vector<int>& elements) {
    const int m = add("IFCMATERIAL('" + name + "')");
    std::string list;
    for (const int e : elements) list += (list.empty() ? "" : ",") + ref(e);
    add("IFCRELASSOCIATESMATERIAL('g',$,$,$,(" + list + ")," + ref(m) + ")");
  }
  std::string str() const {
    return "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_SCHEMA(('" + schema_ +
           "'));\nENDSEC;\nDATA;\n/* a remark */\n" + body_ + "ENDSEC;\nEND-ISO-10303-21;\n";
  }

 private:
  std::string schema_, body_;
  double unit_, c_, s_;
  int last_ = 0;
};

/// Two by three columns of 40 cm x 50 cm over two storeys of 3.2 m and 3 m, beams along x, floors, one brick wall,
/// footings.
std::string make_building(const std::string& schema, double unit, double angle) {
  IfcWriter f(schema, unit, angle);
  f.storey("Ground", 0);
  f.storey("First", 3.2);
  f.storey("Roof", 6.2);
  std::vector<int> concrete;
  const double xs[] = {10, 16}, ys[] = {20, 24, 28};
  const double floors[] = {0, 3.2, 6.2};
  // one profile for all columns, through a map, as programs write it
  const int profile = f.add("IFCRECTANGLEPROFILEDEF(.AREA.,'C',$," + f.number(0.4) + "," + f.number(0.5) + ")");
  for (int s = 0; s < 2; ++s) {
    const double h = floors[s + 1] - floors[s];
    const int up = f.add("IFCDIRECTION((0.,0.,1.))");
    const int solid = f.add("IFCEXTRUDEDAREASOLID(" + f.ref(profile) + ",$," + f.ref(up) + "," + f.number(h) + ")");
    const int mapped = f.add("IFCSHAPEREPRESENTATION($,'Body','SweptSolid',(" + f.ref(solid) + "))");
    const int origin = f.add("IFCCARTESIANPOINT((0.,0.,0.))");
    const int axes = f.add("IFCAXIS2PLACEMENT3D(" + f.ref(origin) + ",$,$)");
    const int map = f.add("IFCREPRESENTATIONMAP(" + f.ref(axes) + "," + f.ref(mapped) + ")");
    const int target = f.add("IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$," + f.ref(origin) + ",1.,$)");
    for (const double x : xs)
      for (const double y : ys) {
        const int item = f.add("IFCMAPPEDITEM(" + f.ref(map) + "," + f.ref(target) + ")");
        concrete.push_back(
            f.element("IFCCOLUMN", f.placement(x, y, floors[s]), f.definition("MappedRepresentation", item), "'1'"));
      }
    for (const double y : ys)
      concrete.push_back(f.element("IFCBEAM", f.placement(13, y, floors[s + 1] - 0.6), f.shape(6.4, 0.3, 0.6), "$"));
    concrete.push_back(
        f.element("IFCSLAB", f.placement(13, 24, floors[s + 1] - 0.18), f.shape(6.4, 8.5, 0.18), "$,.FLOOR."));
  }
  const int wall = f.element("IFCWALLSTANDARDCASE", f.placement(10, 22, 0), f.shape(0.24, 3.6, 3), "$");
  f.material("Ziegelmauerwerk", {wall});
  const int window = f.element("IFCOPENINGELEMENT", f.placement(10, 22, 1), f.shape(0.4, 1.2, 1.4), "$");
  f.add("IFCRELVOIDSELEMENT('g',$,$,$," + f.ref(wall) + "," + f.ref(window) + ")");
  f.material("Concrete, C20/25", concrete);
  f.element("IFCFOOTING", f.placement(10, 20, -0.5), f.shape(1, 1, 0.5), "$,.PAD_FOOTING.");
  f.element("IFCSTAIR", f.placement(12, 22, 0), f.shape(1, 1, 3), "$,.NOTDEFINED.");
  // eight bars and a tie in the first column
  for (int i = 0; i < 8; ++i)
    f.add("IFCREINFORCINGBAR('g',$,'bar',$,$," + f.ref(f.placement(9.85 + 0.3 * (i % 2), 19.8 + 0.13 * (i / 2), 0.05)) +
          ",$,$,'BSt 420/500'," + f.number(0.025) + "," + f.number(4.9e-4) + "," + f.number(3) + ",.MAIN.,$)");
  f.add("IFCREINFORCINGBAR('g',$,'tie',$,$," + f.ref(f.placement(9.85, 19.8, 0.5)) + ",$,$,'BSt 420/500'," +
        f.number(0.008) + "," + f.number(5e-5) + "," + f.number(1.5) + ",.LIGATURE.,$)");
  return f.str();
}

struct Case {
  const char* schema;
  double unit, angle;
};
class ImportIfc : public testing::TestWithParam<Case> {};

TEST_P(ImportIfc, FindsGridStoreysMembersAndBars) {
  const auto [schema, unit, angle] = GetParam();
  const Import made = make_plan_text(read_ifc(make_building(schema, unit, angle), "b.ifc"), "b.ifc");
  const std::string& t = made.text;
  EXPECT_THAT(t, HasSubstr("title = \"Halle Ä 'Nord'\""));
  EXPECT_THAT(t, HasSubstr("rows = { A = \"0.000 m\", B = \"6.000 m\" }"));
  EXPECT_THAT(t, HasSubstr("frames = { 1 = \"0.000 m\", 2 = \"4.000 m\", 3 = \"8.000 m\" }"));
  EXPECT_THAT(t, HasSubstr("heights = [\"3.200 m\", \"3.000 m\"]"));
  EXPECT_THAT(t, HasSubstr("[section.column_400x500_Concrete__C20_25]\nwidth = \"40 cm\"\nheight = \"50 cm\""));
  EXPECT_THAT(t, HasSubstr("bars = { count_y = 2, count_z = 4, diameter = \"25 mm\" }"));
  EXPECT_THAT(t, HasSubstr("ties = { diameter = \"8 mm\", spacing = \"?\" }"));
  EXPECT_THAT(t, HasSubstr("[section.beam_300x600_Concrete__C20_25]"));
  EXPECT_THAT(t, HasSubstr("thickness = \"18 cm\""));
  EXPECT_THAT(t, HasSubstr("fc = \"20 N/mm2\""));
  EXPECT_THAT(t, HasSubstr("Ec = \"30.0 GPa\""));  // 22 (28 / 10)^0.3 = 29.96
  EXPECT_THAT(t, HasSubstr("fy = \"420 N/mm2\""));
  EXPECT_THAT(t, HasSubstr("at = [\"A1\", \"A2\", \"A3\", \"B1\", \"B2\", \"B3\"]"));
  EXPECT_THAT(t, HasSubstr("at = [\"A1B1\", \"A2B2\", \"A3B3\"]"));
  EXPECT_THAT(t, HasSubstr("at = [\"A1B2\", \"A2B3\"]"));
  EXPECT_THAT(t, HasSubstr("[[walls]]\npanel = \"wall_240_Ziegelmauerwerk\"\nstoreys = 0\nat = [\"A1A2\"]"));
  EXPECT_THAT(t, HasSubstr("density = \"?\"\nstrength = \"?\""));
  const ImportReport& r = made.report;
  EXPECT_THAT(r.taken, Contains(HasSubstr("12 columns in 1 section")));
  EXPECT_THAT(r.taken, Contains(HasSubstr("6 beams")));
  EXPECT_THAT(r.guessed, Contains(HasSubstr("can be the unsafe side")));
  EXPECT_THAT(r.missing, Contains(HasSubstr("FOOTING: foundations belong to the ground")));
  EXPECT_THAT(r.missing, Contains(HasSubstr("STAIR: is not taken")));
  if (angle != 0) { EXPECT_THAT(r.guessed, Contains(HasSubstr("turned by 20.0 deg"))); }
}

INSTANTIATE_TEST_SUITE_P(Files, ImportIfc,
                         testing::Values(Case{"IFC2X3", 1e-3, 0}, Case{"IFC4", 1, 0},
                                         Case{"IFC4", 1e-3, 20 * 3.14159265358979323846 / 180}),
                         [](const auto& i) { return std::string(i.param.schema) + "_" + std::to_string(i.index); });

TEST(ImportedPlan, IsRefusedGapByGapAndReadsOnceTheyAreFilled) {
  std::string text = make_plan_text(read_ifc(make_building("IFC4", 1, 0), "b.ifc"), "b.ifc").text;
  std::vector<Diagnostic> warnings;
  try {
    read_plan(text, "plan.toml", warnings);
    FAIL() << "a plan with gaps was read";
  } catch (const InputError& e) {
    bool names_cover = false;
    for (const Diagnostic& d : e.diagnostics()) {
      EXPECT_EQ(d.code, "E211") << d.message;
      names_cover |= d.message.find("section.beam_300x600_Concrete__C20_25.cover") != std::string::npos;
      EXPECT_GT(d.where.line, 1);
    }
    EXPECT_TRUE(names_cover);
  }
  const auto fill = [&text](const char* pattern, const char* value) {
    const std::string before = text;
    text = std::regex_replace(text, std::regex(pattern), value);
    EXPECT_NE(text, before) << pattern;
  };
  fill("cover = \"\\?\"", "cover = \"3 cm\"");
  fill("ties = \\{ diameter = \"\\?\"", "ties = { diameter = \"8 mm\"");
  fill("spacing = \"\\?\"", "spacing = \"20 cm\"");
  fill("(as_top|as_bottom) = \"\\?\"", "$1 = \"5 cm2/m\"");
  fill("(top|bottom) = \"\\?\"", "$1 = \"4 x 20 mm\"");
  fill("fu = \"\\?\"\neps_u = \"\\?\"", "fu = \"500 N/mm2\"\neps_u = 0.1");
  fill("density = \"\\?\"\nstrength = \"\\?\"\nmodulus = \"\\?\"",
       "density = \"1800 kg/m3\"\nstrength = \"5 N/mm2\"\nmodulus = \"3 GPa\"");
  fill("load = \"\\?\"", "load = \"1 kN/m2\"");
  const Plan plan = read_plan(text, "plan.toml", warnings);
  int columns = 0, beams = 0, slabs = 0, walls = 0;
  for (const Member& m : plan.members) {
    columns += m.kind == MemberKind::Column;
    beams += m.kind == MemberKind::Beam;
    slabs += m.kind == MemberKind::Slab;
    walls += m.kind == MemberKind::Wall;
    if (m.kind != MemberKind::Wall) continue;
    ASSERT_EQ(m.openings.size(), 1u);
    EXPECT_NEAR(m.openings[0].left, 1.4, 1e-9);
    EXPECT_NEAR(m.openings[0].sill, 1, 1e-9);
    EXPECT_NEAR(m.openings[0].width, 1.2, 1e-9);
    EXPECT_NEAR(m.openings[0].height, 1.4, 1e-9);
  }
  EXPECT_EQ(columns, 12);
  EXPECT_EQ(beams, 6);
  EXPECT_EQ(slabs, 4);
  EXPECT_EQ(walls, 1);
}

std::string complaint(const std::string& text) {
  try {
    read_ifc(text, "b.ifc");
  } catch (const InputError& e) { return e.diagnostics()[0].code + " " + e.diagnostics()[0].message; }
  return "none";
}

TEST(ImportIfcErrors, NameWhatIsWrong) {
  EXPECT_THAT(complaint("hello"), HasSubstr("E111"));
  const std::string good = make_building("IFC4", 1, 0);
  EXPECT_THAT(complaint(good.substr(0, good.size() / 2)), HasSubstr("E111"));
  EXPECT_THAT(complaint(std::regex_replace(good, std::regex("'IFC4'"), "'AP214'")), HasSubstr("E112"));
  EXPECT_THAT(complaint(std::regex_replace(good, std::regex("IFCCOLUMN"), "IFCPLATE")), HasSubstr("no columns"));
  // references in circles end
  EXPECT_EQ(
      complaint(
          "ISO-10303-21;\nFILE_SCHEMA(('IFC4'));\nDATA;\n#1=IFCLOCALPLACEMENT(#1,$);\n"
          "#2=IFCMAPPEDITEM(#3,#3);\n#3=IFCREPRESENTATIONMAP($,#4);\n#4=IFCSHAPEREPRESENTATION($,'Body','x',(#2));\n"
          "#5=IFCPRODUCTDEFINITIONSHAPE($,$,(#4));\n#6=IFCCOLUMN('',$,'',$,$,#1,#5,$);\nENDSEC;\n"),
      "E112 it has no columns whose body is an extruded profile");
}

std::string dxf(const std::string& header, const std::string& entities) {
  return "0\nSECTION\n2\nHEADER\n" + header + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n" + entities + "0\nENDSEC\n0\nEOF\n";
}
std::string polyline(const std::string& layer, int closed) {
  return "0\nLWPOLYLINE\n8\n" + layer + "\n90\n4\n70\n" + std::to_string(closed) +
         "\n10\n20000.0\n20\n0.0\n10\n30000.0\n20\n0.0\n10\n30000.0\n20\n9000.0\n10\n20000.0\n20\n9000.0\n";
}

TEST(ImportDxf, TakesClosedOutlinesInTheUnitOfTheHeader) {
  const Import made = make_site_text(
      dxf("9\n$INSUNITS\n70\n4\n",
          polyline("Houses", 1) + polyline("Gasleitung", 1) + polyline("Fences", 0) +
              "0\nPOLYLINE\n8\nHouses\n70\n1\n0\nVERTEX\n10\n0.0\n20\n-9000.0\n0\nVERTEX\n10\n5000.0\n20\n"
              "-9000.0\n0\nVERTEX\n10\n5000.0\n20\n-4000.0\n0\nSEQEND\n0\nLINE\n8\nx\n10\n1.0\n20\n1.0\n"),
      "s.dxf", 0);
  EXPECT_THAT(made.text,
              HasSubstr("[[site.neighbour]]\nname = \"Houses 1\"\nfootprint = [[\"20.000 m\", \"0.000 m\"]"));
  EXPECT_THAT(made.text,
              HasSubstr("name = \"Houses 2\"\nfootprint = [[\"0.000 m\", \"-9.000 m\"], [\"5.000 m\", \"-9.000 m\"]"));
  EXPECT_THAT(made.text, HasSubstr("[[site.utility]]\nname = \"Gasleitung 1\""));
  EXPECT_THAT(made.text, testing::Not(HasSubstr("Fences")));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("1 open polylines")));
  // another unit, as the caller wants it
  EXPECT_THAT(make_site_text(dxf("", polyline("H", 1)), "s.dxf", 1e-2).text, HasSubstr("\"200.000 m\""));
  EXPECT_THAT(
      make_site_text(dxf("", "0\nLWPOLYLINE\n8\nH\n70\n1\n10\n20\n20\n0\n10\n30\n20\n0\n10\n30\n20\n9\n"), "s.dxf", 0)
          .report.guessed,
      Contains(HasSubstr("are metres")));
  EXPECT_THROW(make_site_text(dxf("", ""), "s.dxf", 0), InputError);
  EXPECT_THROW(make_site_text("AutoCAD Binary DXF\n\x1a\n", "s.dxf", 0), InputError);
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("left out: 1 LINE")));
}

TEST(ImportDxf, RefusesCoordinatesThatAreNone) {
  for (const char* wrong : {"abc", "1.0x", "nan", "1e300", ""}) {
    std::string text = dxf("", polyline("H", 1));
    text.replace(text.find("30000.0"), 7, wrong);
    try {
      (void)make_site_text(text, "s.dxf", 0);
      FAIL() << wrong;
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics().front().code, "E113");
      EXPECT_EQ(e.diagnostics().front().where.line, 24) << wrong;
    }
  }
}

TEST(ImportDxf, ReadsBehindAByteOrderMark) {
  const std::string whole = dxf("", polyline("A", 1));
  EXPECT_EQ(make_site_text("\xEF\xBB\xBF" + whole, "s.dxf", 1e-3).text, make_site_text(whole, "s.dxf", 1e-3).text);
}

TEST(ImportDxf, RefusesDrawingsThatAreCutOff) {
  const std::string whole = dxf("", polyline("A", 1) + polyline("B", 1)), end = "0\nENDSEC\n0\nEOF\n";
  const auto place = [](const std::string& text) {
    try {
      (void)make_site_text(text, "s.dxf", 1e-3);
    } catch (const InputError& e) {
      return e.diagnostics()[0].code + ":" + std::to_string(e.diagnostics()[0].where.line);
    }
    return std::string("none");
  };
  EXPECT_EQ(place(whole), "none");
  EXPECT_EQ(place(whole + "0"), "none") << "what stands behind the end";
  const std::string entities = whole.substr(0, whole.size() - end.size());
  EXPECT_EQ(place(entities), "E113:58");
  EXPECT_EQ(place(entities + "0\nENDSEC\n"), "E113:60");
  EXPECT_EQ(place(entities + "0\nEOF\n"), "E113:60");
  // inside an outline, and between a group code and its value
  EXPECT_EQ(place(whole.substr(0, whole.rfind("\n20000.0") + 1)), "E113:54");
  EXPECT_EQ(place(whole.substr(0, whole.rfind("\n20\n9000.0"))), "E113:56");
  EXPECT_EQ(place(""), "E113:1");
}

TEST(ImportDxf, ReadsNamesOfOldDrawingsAndPlanesSeenFromBelow) {
  const Import latin = make_site_text(dxf("", polyline("Geb\xE4ude", 1)), "s.dxf", 1e-3);
  EXPECT_THAT(latin.text, HasSubstr("name = \"Gebäude 1\""));
  EXPECT_THAT(latin.report.guessed, Contains(HasSubstr("ISO 8859-1")));
  EXPECT_THAT(make_site_text(dxf("", polyline("Gebäude", 1)), "s.dxf", 1e-3).text, HasSubstr("name = \"Gebäude 1\""));
  std::string below = polyline("H", 1);
  below.insert(below.find("10\n20000.0"), "210\n0\n220\n0\n230\n-1\n");
  EXPECT_THAT(make_site_text(dxf("", below), "s.dxf", 1e-3).text,
              HasSubstr("footprint = [[\"-20.000 m\", \"0.000 m\"], [\"-30.000 m\", \"0.000 m\"]"));
}

TEST(ImportDxf, CountsWhatIsNoFootprintByKind) {
  const auto light = [](const std::string& head, const std::string& corners) {
    return "0\nLWPOLYLINE\n8\nH\n70\n1\n" + head + corners;
  };
  const std::string square = "10\n20\n20\n0\n10\n30\n20\n0\n10\n30\n20\n10\n10\n20\n20\n10\n";
  const auto heavy = [](int flags, int vertex_flags) {
    std::string out = "0\nPOLYLINE\n8\nH\n66\n1\n70\n" + std::to_string(flags) + "\n";
    for (const char* corner : {"10\n40\n20\n0\n", "10\n50\n20\n0\n", "10\n50\n20\n10\n"})
      out += std::string("0\nVERTEX\n8\nH\n") + corner + "30\n0\n70\n" + std::to_string(vertex_flags) + "\n";
    return out + "0\nSEQEND\n";
  };
  const Import made =
      make_site_text(dxf("", light("", square) + light("67\n1\n", square) + light("210\n1\n220\n0\n230\n0\n", square) +
                                 light("210\n0\n220\n0\n230\n1\n", square) + heavy(17, 0) + heavy(65, 64) +
                                 heavy(1, 0) + heavy(5, 16) + light("", "10\n0\n20\n0\n10\n5\n10\n5\n20\n5\n") +
                                 light("", "10\n0\n20\n0\n10\n5\n20\n5\n10\n5\n") +
                                 light("", "10\n0\n20\n0\n10\n5\n20\n0\n10\n9\n20\n0\n") +
                                 light("", "10\n0\n20\n0\n10\n6\n20\n5\n10\n5\n20\n0\n10\n0\n20\n9\n")),
                     "s.dxf", 1);
  EXPECT_THAT(made.report.taken, Contains("3 closed outlines"));
  for (const char* left : {"1 outlines in paper space", "1 outlines that do not lie flat", "2 polygon meshes",
                           "2 outlines with a corner without y", "1 outlines of fewer than three corners",
                           "1 outlines without area", "1 outlines whose edges cross"})
    EXPECT_THAT(made.report.missing, Contains(std::string(left) + " are left out")) << left;
  try {
    (void)make_site_text(dxf("", light("67\n1\n", square)), "s.dxf", 1);
    FAIL() << "a frame of paper was taken";
  } catch (const InputError& e) {
    EXPECT_THAT(e.diagnostics()[0].help, HasSubstr("1 outlines in paper space are left out"));
  }
}

}  // namespace
}  // namespace topple::product
