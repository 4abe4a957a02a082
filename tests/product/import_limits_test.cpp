// Names, numbers and units that a plan cannot hold as they are: each import is an error or a plan that reads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <regex>

#include "base/error.h"
#include "ifc_writer.h"
#include "product/plan.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// Four columns of the material, one storey.
Import import_of(const std::string& material) {
  Writer w;
  w.metres();
  w.material(material, add_square_columns(w));
  return import("IFC4", w);
}

TEST(ImportIfcClasses, AreReadInNamesOfAnyLength) {
  EXPECT_THAT(import_of("Beton C 25 / 30 XC1").text, HasSubstr("fc = \"25 N/mm2\""));
  EXPECT_THAT(import_of("Concrete C100/115").text, HasSubstr("fc = \"100 N/mm2\""));
  EXPECT_THAT(import_of("C" + std::string(300000, ' ') + "20/25").text, HasSubstr("fc = \"20 N/mm2\""));
  for (const std::string& none :
       {"C" + std::string(400, '9') + "/1", std::string("C999/1000"), std::string("C0/0"), std::string("C25/20"),
        std::string("ABC25/30"), std::string("C25"), std::string("C/30"), "C" + std::string(300000, '2') + "/25"}) {
    const Import made = import_of(none);
    EXPECT_THAT(made.text, HasSubstr("fc = \"?\"\nEc = \"?\"")) << none.substr(0, 40);
    EXPECT_THAT(made.report.missing, Contains(HasSubstr(": fc and Ec"))) << none.substr(0, 40);
  }
}

TEST(ImportIfcClasses, LeaveAGapForATensileStrengthThatHasNoFormula) {
  EXPECT_THAT(import_of("C8/10").text, HasSubstr("fct = \"?\""));
  EXPECT_THAT(import_of("C12/15").text, Not(HasSubstr("fct")));
}

TEST(ImportIfcClasses, OfHighStrengthHaveAStrainAtThePeakThatAPlanTakes) {
  // Ec = 22 GPa 10.8^0.3 = 44.9 GPa: 1.05 fc / Ec = 0.00234
  EXPECT_THAT(import_of("C100/115").text,
              HasSubstr("Ec = \"44.9 GPa\"  # 22 GPa ((fck + 8) / 10)^0.3\neps_c1 = 0.0028"));
  EXPECT_THAT(import_of("C100/115").report.guessed, Contains(HasSubstr("eps_c1 = 0.0028, that of C90/105")));
  EXPECT_THAT(import_of("C90/105").text, Not(HasSubstr("eps_c1")));
}

TEST(ImportIfcClasses, OfLightweightConcreteLeaveGapsForWhatHangsOnItsDensity) {
  const Import made = import_of("LC25/28");
  EXPECT_THAT(made.text, HasSubstr("fc = \"25 N/mm2\""));
  // Eurocode 2, table 11.3.1: 22 GPa 3.3^0.3 = 31.5 GPa, 0.3 N/mm2 25^(2/3) = 2.6 N/mm2
  EXPECT_THAT(made.text, HasSubstr("Ec = 31.5 GPa (density / 2200 kg/m3)^2, fct = 2.6 N/mm2 (0.4 + 0.6 density"));
  EXPECT_THAT(made.text, HasSubstr("\nEc = \"?\"\nfct = \"?\"\ndensity = \"?\"\n"));
  EXPECT_THAT(made.report.taken, Contains(HasSubstr("class LC25/28")));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("density, Ec and fct of lightweight concrete")));
  EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("Ec from the class"))));
}

/// Complaints of a plan that are no gaps.
std::vector<std::string> faults(const std::string& plan) {
  std::vector<std::string> out;
  try {
    std::vector<Diagnostic> warnings;
    (void)read_plan(plan, "plan.toml", warnings);
  } catch (const InputError& e) {
    for (const Diagnostic& d : e.diagnostics())
      if (d.code != "E211") out.push_back(d.code + " " + d.message);
  }
  return out;
}

TEST(ImportIfcNames, OfMaterialsThatLookAlikeAsKeysStayApart) {
  Writer w;
  w.metres();
  const std::string same(40, 'a');
  // in other scripts, too: two characters of Chinese
  for (const std::string& name : {std::string("C20/25"), std::string("C20-25"), std::string("\\X2\\6DF7\\X0\\"),
                                  std::string("\\X2\\6DF8\\X0\\"), same + "1", same + "2", std::string("C20_25_2")}) {
    static int x = 0;
    w.material(name, w.element("IFCCOLUMN", w.placement("$", 5 * x++, 0, 0),
                               w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3))));
  }
  const Import made = import("IFC4", w);
  EXPECT_THAT(faults(made.text), testing::IsEmpty());
  for (const char* key : {"C20_25]", "C20_25_2]", "___]", "____2]", "C20_25_2_2]"})
    EXPECT_THAT(made.text, HasSubstr(std::string("[section.column_400x400_") + key)) << key;
  EXPECT_THAT(made.text, HasSubstr("[concrete.C20_25]  # \"C20/25\" in the file"));
  EXPECT_THAT(made.text, HasSubstr("[concrete.C20_25_2]  # \"C20-25\" in the file\nfc = \"?\""));
}

TEST(ImportIfcNames, AreCutBetweenCharactersAndHoldNoControls) {
  for (const std::string& name :
       {std::string(79, 'a') + "\\X\\E4", "x" + std::string(60, '\xE4'), std::string("a\\X\\7Fb\\X\\0Ac\"d")}) {
    Writer w;
    w.metres();
    w.add("IFCBUILDING('g',$,'" + name + "',$,$,$,$,$,.ELEMENT.,$,$,$)");
    add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
    EXPECT_THAT(faults(import("IFC4", w).text), testing::IsEmpty()) << name;
    EXPECT_THAT(faults(import_of(name).text), testing::IsEmpty()) << name;
  }
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  EXPECT_THAT(faults(make_plan_text(read_ifc(ifc_file("IFC4", w.str()), "b"), "\xE4\n\x7F.ifc").text),
              testing::IsEmpty())
      << "names of files";
}

TEST(ImportDxfNames, HoldNoControlsAndAreOnesOwn) {
  std::string drawing = "0\nSECTION\n2\nENTITIES\n";
  for (const char* layer : {"", "outline", "a\x7F", "a", "a 1"})
    drawing += std::string("0\nLWPOLYLINE\n8\n") + layer + "\n70\n1\n10\n0\n20\n50\n10\n9\n20\n50\n10\n9\n20\n59\n";
  const std::string text = make_site_text(drawing + "0\nENDSEC\n0\nEOF\n", "s\n.dxf", 0).text;
  EXPECT_THAT(faults(text), testing::IsEmpty());
  for (const char* name : {"outline 1", "outline 2", "a 1", "a 2", "a 1 1"})
    EXPECT_THAT(text, HasSubstr(std::string("name = \"") + name + "\"")) << name;
}

std::string complaint(const std::function<void()>& run) {
  try {
    run();
  } catch (const InputError& e) {
    const Diagnostic& d = e.diagnostics()[0];
    return d.code + ":" + std::to_string(d.where.line) + " " + d.message;
  }
  return "none";
}

/// A column of 0.4 m x 0.4 m, 3 m high unless said.
std::string add_column(Writer& w, double x, double y, double size = 0.4, double height = 3) {
  return w.element("IFCCOLUMN", w.placement("$", x, y, 0),
                   w.shape("SweptSolid", w.extrusion(w.rectangle(size, size), height)));
}

TEST(ImportIfcNumbers, BeyondAllRangesAreRefusedWithTheirLine) {
  for (const char* number : {"1E400", "-1E400", "-inf"}) {
    Writer w;
    w.metres();
    add_column(w, 0, 0);
    w.add(std::string("IFCCARTESIANPOINT((0.,") + number + "))");
    const std::string text = ifc_file("IFC4", w.str());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<long>(text.find(number)), '\n');
    EXPECT_EQ(complaint([&] { (void)read_ifc(text, "b.ifc"); }),
              "E111:" + std::to_string(line) + " a number is out of range");
  }
}

TEST(ImportIfcSizes, ThatAPlanCannotHoldAreLeftOutOrRefused) {
  Writer w;
  w.metres();
  for (const double x : {0.0, 6.0})
    for (const double y : {0.0, 5.0}) add_column(w, x, y);
  add_column(w, 1e300, 0);
  add_column(w, 3, 0, 0.04);
  add_column(w, 3, 5, 30);
  w.element("IFCSLAB", w.placement("$", 3, 2.5, 2.98), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 5), 0.02)));
  w.element("IFCBEAM", w.placement("$", 3, 0, 0), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 0.3), 3)));
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"6.000 m\" }"));
  EXPECT_THAT(made.report.missing, Contains("1 x COLUMN: its place or its size is out of range"));
  EXPECT_THAT(made.report.missing, Contains("2 x COLUMN: the sides of its section are not between 5 cm and 10 m"));
  EXPECT_THAT(made.report.missing, Contains("1 x SLAB: its thickness is not between 3 cm and 3 m"));
  EXPECT_THAT(made.report.missing, Contains("1 x BEAM: is as deep as its storey is high"));
  const auto refused = [](double x, double size, double height) {
    return complaint([&] {
      Writer f;
      f.metres();
      for (const double at : {0.0, x}) add_column(f, at, 0, size, height);
      (void)import("IFC4", f);
    });
  };
  EXPECT_THAT(refused(2000, 0.4, 3), HasSubstr("E112:0 its columns stand over 2000 m"));
  EXPECT_THAT(refused(5, 0.4, 0.3), HasSubstr("storey 0 would be 0.300 m high"));
  EXPECT_THAT(refused(5, 0.4, 60), HasSubstr("storey 0 would be 60.000 m high"));
  EXPECT_THAT(refused(5, 0.01, 3), HasSubstr("no column of 5 cm to 10 m"));
}

TEST(ImportIfcGrid, KeepsItsLinesApart) {
  // groups from 0 m and from 0.31 m, whose middles are 0.16 m apart
  Writer w;
  w.metres();
  for (const double x : {0.0, 0.29, 0.31, 0.32, 6.0}) add_column(w, x, 0, 0.1);
  EXPECT_THAT(import("IFC4", w).text, HasSubstr("rows = { A = \"0.000 m\", B = \"5.770 m\" }"));
}

TEST(ImportIfcBars, ThatAPlanCannotHoldAreGaps) {
  Writer w;
  w.metres();
  const std::string column = add_column(w, 0, 0);
  for (const double x : {-0.15, 0.15})
    for (const double y : {-0.15, 0.15})
      w.add("IFCREINFORCINGBAR('g',$,'bar',$,$," + w.placement("$", x, y, 0.1) + ",$,$,'B500B',0.2,0.03,3.,.MAIN.,$)");
  w.add("IFCREINFORCINGBAR('g',$,'tie',$,$," + w.placement("$", 0, 0, 0.1) + ",$,$,'B500B',0.1,0.03,3.,.LIGATURE.,$)");
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("bars = { count_y = \"?\", count_z = \"?\", diameter = \"?\" }"));
  EXPECT_THAT(made.text, HasSubstr("ties = { diameter = \"?\", spacing = \"?\" }"));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("its 4 bars of 200 mm, which a plan cannot hold")));
}

/// A column with four bars of this grade.
void add_reinforced(Writer& w, double x, const std::string& grade) {
  (void)add_column(w, x, 0, x > 0 ? 0.5 : 0.4);
  for (const double dx : {-0.15, 0.15})
    for (const double y : {-0.15, 0.15})
      w.add("IFCREINFORCINGBAR('g',$,'bar',$,$," + w.placement("$", x + dx, y, 0.1) + ",$,$,'" + grade +
            "',0.02,0.0003,3.,.MAIN.,$)");
}

TEST(ImportIfcBars, HaveTheStrengthThatTheirGradeNames) {
  const auto yield_of = [](const std::string& grade) {
    Writer w;
    w.metres();
    add_reinforced(w, 0, grade);
    const std::string text = import("IFC4", w).text;
    const size_t at = text.find("fy = \"") + 6;
    return text.substr(at, text.find('"', at) - at);
  };
  EXPECT_EQ(yield_of("B500B"), "500 N/mm2");
  EXPECT_EQ(yield_of("DIN EN 10080:2005 B500B"), "500 N/mm2");
  EXPECT_EQ(yield_of("EN 1992-1-1:2004 B500A"), "500 N/mm2");
  EXPECT_EQ(yield_of("DIN 1045-1:2008 BSt 500 S"), "500 N/mm2");
  EXPECT_EQ(yield_of("BSt 420/500 RK"), "420 N/mm2");
  for (const char* none : {"60000 psi", "St 1570/1770", "Grade 420 ksi", "220 or 500", "?"})
    EXPECT_EQ(yield_of(none), "?") << none;
}

TEST(ImportIfcBars, OfTwoGradesAreTwoSteels) {
  Writer w;
  w.metres();
  add_reinforced(w, 0, "BSt 220");
  add_reinforced(w, 6, "B500B");
  const std::string text = import("IFC4", w).text;
  EXPECT_THAT(text, HasSubstr("[steel.bars]\nfy = \"220 N/mm2\""));
  EXPECT_THAT(text, HasSubstr("[steel.bars_2]\nfy = \"500 N/mm2\""));
  EXPECT_THAT(text, HasSubstr("width = \"40 cm\"\nheight = \"40 cm\"\nconcrete = \"unknown\"\nsteel = \"bars\""));
  EXPECT_THAT(text, HasSubstr("width = \"50 cm\"\nheight = \"50 cm\"\nconcrete = \"unknown\"\nsteel = \"bars_2\""));
}

TEST(ImportIfcProfiles, ThatAreRoundedOrPartOfThemselves) {
  const auto width_of = [](const std::string& radius) {
    Writer w;
    w.metres();
    const std::string profile = w.add("IFCROUNDEDRECTANGLEPROFILEDEF(.AREA.,$,$,0.3,0.3," + radius + ")");
    w.element("IFCCOLUMN", w.placement("$", 0, 0, 0), w.shape("SweptSolid", w.extrusion(profile, 3)));
    const std::string text = import("IFC4", w).text;
    const size_t at = text.find("width = \"") + 9;
    return text.substr(at, text.find('"', at) - at);
  };
  EXPECT_EQ(width_of("0.02"), "30 cm");
  EXPECT_EQ(width_of("0.15"), "26.6 cm");  // a circle: as a square of its area
  Writer w;
  w.metres();
  (void)add_column(w, 0, 0);
  const std::string turn = w.add("IFCCARTESIANTRANSFORMATIONOPERATOR2D($,$," + w.point(0, 0, 0) + ",$)");
  const std::string next = w.add("IFCDIRECTION((0.,0.,1.))");
  const std::string own = "#" + std::to_string(std::stoi(next.substr(1)) + 1);
  const std::string profile = w.add("IFCDERIVEDPROFILEDEF(.AREA.,$," + own + "," + turn + ",$)");
  ASSERT_EQ(profile, own);
  w.element("IFCCOLUMN", w.placement("$", 6, 0, 0), w.shape("SweptSolid", w.extrusion(profile, 3)));
  EXPECT_THAT(import("IFC4", w).report.missing, Contains(HasSubstr("its profile is nested too deeply")));
}

TEST(ImportIfcMaps, ThatMultiplyOrArePartOfThemselvesAreLeftOut) {
  const auto map_of = [](Writer& w, const std::string& items, int turns, int each) {
    std::string item = items;
    const std::string origin = w.point(0, 0, 0), axes = w.add("IFCAXIS2PLACEMENT3D(" + origin + ",$,$)"),
                      target = w.add("IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$," + origin + ",$,$)");
    for (int i = 0; i < turns; ++i) {
      std::string list = item;
      for (int k = 1; k < each; ++k) list += "," + item;
      item = w.add("IFCMAPPEDITEM(" +
                   w.add("IFCREPRESENTATIONMAP(" + axes + "," +
                         w.add("IFCSHAPEREPRESENTATION($,'Body','MappedRepresentation',(" + list + "))") + ")") +
                   "," + target + ")");
    }
    return item;
  };
  const auto bar_of = [](Writer& w, const std::string& item) {
    w.add("IFCREINFORCINGBAR('g',$,'b',$,$," + w.placement("$", 0, 0, 0) + "," + w.shape("MappedRepresentation", item) +
          ",$,'B500B',0.02,$,$,.MAIN.,$)");
  };
  Writer w;
  w.metres();
  add_square_columns(w);
  // eight to the ninth power of them
  const std::string circle = w.add("IFCCIRCLEPROFILEDEF(.AREA.,$,$,0.01)"),
                    many = map_of(w, w.extrusion(circle, 1), 9, 8);
  bar_of(w, many);
  w.element("IFCCOLUMN", w.placement("$", 3, 0, 0), w.shape("MappedRepresentation", many));
  // a map of ten of itself
  const std::string last = w.point(0, 0, 0);
  const auto next = [&last](int i) { return "#" + std::to_string(std::stoi(last.substr(1)) + i); };
  const std::string own = next(5);
  std::string list = own;
  for (int k = 1; k < 10; ++k) list += "," + own;
  w.add("IFCAXIS2PLACEMENT3D(" + last + ",$,$)");
  w.add("IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$," + last + ",$,$)");
  w.add("IFCSHAPEREPRESENTATION($,'Body','MappedRepresentation',(" + list + "))");
  w.add("IFCREPRESENTATIONMAP(" + next(1) + "," + next(3) + ")");
  ASSERT_EQ(w.add("IFCMAPPEDITEM(" + next(4) + "," + next(2) + ")"), own);
  bar_of(w, own);
  // few of them are read
  bar_of(w, map_of(w, w.extrusion(circle, 3), 2, 2));
  const std::string text = ifc_file("IFC4", w.str());
  EXPECT_EQ(read_ifc(text, "b.ifc").bars.size(), 4u);
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.missing,
              Contains("2 x REINFORCINGBAR: its body is part of itself, or has more than 10,000 items"));
  EXPECT_THAT(made.report.missing,
              Contains("1 x COLUMN: only a part of its body is read: its body has more than 10,000 items"));
}

TEST(ImportIfcCurves, ThatMultiplyAreNotRead) {
  Writer w;
  w.metres();
  add_square_columns(w);
  std::string curve = w.add("IFCPOLYLINE((" + w.point(0, 0, 0) + "," + w.point(1, 0, 0) + "))");
  for (int i = 0; i < 9; ++i) {
    const std::string segment = w.add("IFCCOMPOSITECURVESEGMENT(.CONTINUOUS.,.T.," + curve + ")");
    std::string list = segment;
    for (int k = 1; k < 9; ++k) list += "," + segment;
    curve = w.add("IFCCOMPOSITECURVE((" + list + "),.F.)");
  }
  w.element("IFCCOLUMN", w.placement("$", 3, 0, 0),
            w.shape("SweptSolid", w.extrusion(w.add("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + curve + ")"), 3)));
  EXPECT_THAT(import("IFC4", w).report.missing, Contains("1 x COLUMN: its profile is IFCARBITRARYCLOSEDPROFILEDEF"));
}

TEST(ImportIfcReferences, ThatLeadNowhereAreRefused) {
  Writer w;
  w.metres();
  const std::string at =
      w.add("IFCLOCALPLACEMENT($," + w.add("IFCAXIS2PLACEMENT3D(" + w.point(0, 0, 0) + ",$,#99999)") + ")");
  w.element("IFCCOLUMN", at, w.shape("SweptSolid", w.extrusion(w.rectangle(0.6, 0.3), 3)));
  EXPECT_THAT(complaint([&] { (void)import("IFC4", w); }), HasSubstr("refers to #99999, which is not there"));
}

TEST(ImportIfcRules, AreOneForAllStoreysWithTheSamePlaces) {
  Writer w;
  w.metres();
  for (int s = 0; s < 60; ++s)
    for (int i = 0; i < 18; ++i) {
      const bool is_thinner = i == 0 && (s == 4 || s >= 58);
      const double size = is_thinner ? 0.2 : 0.3 + 0.02 * i;
      w.element("IFCCOLUMN", w.placement("$", 6 * (i % 6), 6 * (i / 6), 3 * s),
                w.shape("SweptSolid", w.extrusion(w.rectangle(size, size), 3)));
    }
  const Import made = import("IFC4", w);
  size_t rules = 0;
  for (size_t at = 0; (at = made.text.find("[[columns]]", at)) != std::string::npos; ++at) ++rules;
  EXPECT_EQ(rules, 19u);
  EXPECT_THAT(made.text, HasSubstr("column_300x300_unknown\"\nstoreys = [\"0..3\", \"5..57\"]\nat = [\"A1\"]\n"));
  EXPECT_THAT(made.text, HasSubstr("column_200x200_unknown\"\nstoreys = [4, \"58..59\"]\nat = [\"A1\"]\n"));
  EXPECT_THAT(made.text, HasSubstr("column_640x640_unknown\"\nstoreys = \"0..59\"\nat = [\"F3\"]\n"));
  EXPECT_THAT(made.report.missing, Not(Contains(HasSubstr("still refused"))));
}

TEST(ImportIfcRules, AreLookedAtBehindTheGaps) {
  // more sections than a plan has
  Writer w;
  w.metres();
  for (int i = 0; i < 1001; ++i)
    w.element("IFCCOLUMN", w.placement("$", 6 * (i % 32), 6 * (i / 32), 0),
              w.shape("SweptSolid", w.extrusion(w.rectangle(0.3 + 0.003 * i, 0.3), 3)));
  try {
    import("IFC4", w);
    ADD_FAILURE() << "was taken";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics()[0].code, "E112");
    EXPECT_THAT(e.diagnostics()[0].message, HasSubstr("section: more than 1000 entries"));
  }
  // a slab over a corner without a column
  Writer s;
  s.metres();
  for (const double x : {0.0, 6.0, 12.0})
    for (const double y : {0.0, 5.0})
      if (x != 12 || y != 5)
        s.element("IFCCOLUMN", s.placement("$", x, y, 0), s.shape("SweptSolid", s.extrusion(s.rectangle(0.4, 0.4), 3)));
  s.element("IFCSLAB", s.placement("$", 6, 2.5, 2.8), s.shape("SweptSolid", s.extrusion(s.rectangle(12, 5), 0.2)));
  EXPECT_THAT(import("IFC4", s).report.missing,
              Contains(HasSubstr("when its gaps are filled, the plan is still refused: ")));
}

TEST(ImportDxfSizes, ThatAPlanCannotHoldAreLeftOutOrRefused) {
  const auto drawing = [](const std::string& outlines) {
    return "0\nSECTION\n2\nENTITIES\n" + outlines + "0\nENDSEC\n0\nEOF\n";
  };
  const auto outline = [](double x, int corners) {
    std::string out = "0\nLWPOLYLINE\n8\nH\n70\n1\n";
    for (int i = 0; i < corners; ++i)
      out += "10\n" + std::to_string(x + 5 * std::cos(6.28 * i / corners)) + "\n20\n" +
             std::to_string(5 * std::sin(6.28 * i / corners)) + "\n";
    return out;
  };
  const Import made = make_site_text(drawing(outline(50, 200) + outline(50, 201)), "s.dxf", 0);
  EXPECT_THAT(made.report.taken, Contains("1 closed outlines"));
  EXPECT_THAT(made.report.missing, Contains("1 outlines of more than 200 corners are left out"));
  EXPECT_EQ(complaint([&] { (void)make_site_text(drawing(outline(50, 4) + outline(3.5e6, 4)), "s.dxf", 0); }),
            "E113:28 an outline lies 3500 km from the origin");
  std::string many;
  for (int i = 0; i < 1001; ++i) many += outline(50, 4);
  EXPECT_EQ(complaint([&] { (void)make_site_text(drawing(many), "s.dxf", 0); }), "E113:0 has 1001 closed outlines");
}

/// Columns at 6 and 5 of a unit, 0.4 wide.
Import import_in(const std::function<std::string(Writer&)>& add_unit, double metres) {
  Writer w;
  if (const std::string unit = add_unit(w); !unit.empty()) w.add("IFCUNITASSIGNMENT((" + unit + "))");
  for (const double x : {0.0, 6.0})
    w.element("IFCCOLUMN", w.placement("$", x / metres, 0, 0),
              w.shape("SweptSolid", w.extrusion(w.rectangle(0.4 / metres, 0.4 / metres), 3 / metres)));
  return import("IFC4", w);
}
std::string conversion(Writer& w, const std::string& value, const std::string& base) {
  return w.add("IFCCONVERSIONBASEDUNIT($,.LENGTHUNIT.,'U'," +
               w.add("IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(" + value + ")," + base + ")") + ")");
}

TEST(ImportIfcUnits, AreThoseOfTheFile) {
  const auto prefixed = [](const char* prefix) {
    return [prefix](Writer& w) { return w.add("IFCSIUNIT(*,.LENGTHUNIT.," + std::string(prefix) + ",.METRE.)"); };
  };
  const auto inches = [&](Writer& w) { return conversion(w, "2.54", prefixed(".CENTI.")(w)); };
  const auto feet = [&](Writer& w) { return conversion(w, "12.", inches(w)); };
  const auto is_right = [](const Import& made, const char* unit) {
    EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"6.000 m\" }")) << unit;
    EXPECT_THAT(made.text, HasSubstr("width = \"40 cm\"")) << unit;
    EXPECT_THAT(made.report.taken, Contains("the file's unit is " + std::string(unit) + " m"));
  };
  is_right(import_in(prefixed(".MICRO."), 1e-6), "1e-06");
  is_right(import_in(prefixed(".MILLI."), 1e-3), "0.001");
  is_right(import_in(prefixed(".DECA."), 10), "10");
  is_right(import_in(prefixed(".HECTO."), 100), "100");
  is_right(import_in(prefixed("$"), 1), "1");
  is_right(import_in(inches, 0.0254), "0.0254");
  is_right(import_in(feet, 0.3048), "0.3048");
  EXPECT_EQ(complaint([] { (void)import_in([](Writer&) { return std::string(); }, 1e-3); }),
            "E112:0 it has no column of 5 cm to 10 m in section");
  const Import none = import_in([](Writer&) { return std::string(); }, 1);
  EXPECT_THAT(none.report.guessed, Contains("the file's numbers are metres: it names no unit of length"));
}

TEST(ImportIfcUnits, ThatAreNotUnderstoodAreRefused) {
  for (const char* unit :
       {"IFCSIUNIT(*,.LENGTHUNIT.,.LIGHT.,.METRE.)", "IFCSIUNIT(*,.LENGTHUNIT.,$,.GRAM.)",
        "IFCCONTEXTDEPENDENTUNIT($,.LENGTHUNIT.,'CUBIT')", "IFCCONVERSIONBASEDUNIT($,.LENGTHUNIT.,'FOOT',$)"})
    EXPECT_THAT(complaint([unit] { (void)import_in([unit](Writer& w) { return w.add(unit); }, 1); }),
                HasSubstr("E112:0 its unit of length, #1, is not understood"))
        << unit;
}

TEST(ImportIfcUnits, OfTheProjectGoBeforeOthers) {
  const Import made = import_in(
      [](Writer& w) {
        const std::string metre = w.add("IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)");
        w.add("IFCPROJECT('g',$,'P',$,$,$,$,$," + w.add("IFCUNITASSIGNMENT((" + metre + "))") + ")");
        return w.add("IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.)");
      },
      1);
  EXPECT_THAT(made.text, HasSubstr("width = \"40 cm\""));
}

TEST(ImportDxfUnits, AreAllThoseOfTheHeader) {
  const auto drawing = [](const std::string& unit) {
    return "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n" + unit +
           "\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n8\nH\n70\n1\n10\n0\n20\n0\n10\n3937\n20\n0\n10\n3937\n"
           "20\n"
           "3937\n0\nENDSEC\n0\nEOF\n";
  };
  const auto at = [&](const char* unit) { return make_site_text(drawing(unit), "s.dxf", 0).text; };
  EXPECT_THAT(at("21"), HasSubstr("[\"1200.000 m\", \"0.000 m\"]"));
  EXPECT_THAT(at("22"), HasSubstr("[\"100.000 m\", \"0.000 m\"]"));
  const std::string larger = std::regex_replace(drawing("9"), std::regex("3937"), "39370");
  EXPECT_THAT(make_site_text(larger, "s.dxf", 0).text, HasSubstr("[\"1.000 m\", \"0.000 m\"]"));
  EXPECT_THAT(at("4"), HasSubstr("[\"3.937 m\", \"0.000 m\"]"));
  EXPECT_THAT(complaint([&] { (void)at("3"); }), HasSubstr("E113:16 an outline lies 6336 km"));
  for (const char* unit : {"25", "-1", "abc"}) {
    EXPECT_THAT(complaint([&] { (void)at(unit); }),
                "E113:8 $INSUNITS is \"" + std::string(unit) + "\", which is no unit");
    EXPECT_THAT(make_site_text(drawing(unit), "s.dxf", 1e-3).text, HasSubstr("3.937 m"));
  }
  EXPECT_THAT(make_site_text(drawing("0"), "s.dxf", 0).report.guessed, Contains(HasSubstr("its header does not say")));
}

}  // namespace
}  // namespace topple::product
