// Elements that do not lie along a grid, do not fill their box, share a place, are scaled or have none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "ifc_writer.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// A placement whose local x is turned about z.
std::string turned(Writer& w, double x, double y, double z, double angle) {
  const std::string up = w.add("IFCDIRECTION((0.,0.,1.))");
  const std::string along = w.add("IFCDIRECTION(" + Writer::tuple({std::cos(angle), std::sin(angle), 0}) + ")");
  return w.add("IFCLOCALPLACEMENT($," +
               w.add("IFCAXIS2PLACEMENT3D(" + w.point(x, y, z) + "," + up + "," + along + ")") + ")");
}

/// An upright box centred on its place.
std::string block(Writer& w, const std::string& type, const std::string& place, double x, double y, double z) {
  return w.element(type, place, w.shape("SweptSolid", w.extrusion(w.rectangle(x, y), z)));
}

TEST(ImportIfcAngle, IsThatOfTheColumnsWhateverStandsAskew) {
  for (const double own : {0.0, 30 * unit::deg}) {
    const double c = std::cos(own), s = std::sin(own);
    Writer w;
    w.metres();
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k)
        block(w, "IFCCOLUMN", turned(w, 6 * (c * i - s * k), 6 * (s * i + c * k), 0, own), 0.3, 0.3, 3);
    // longer than all edges of columns together
    block(w, "IFCWALL", turned(w, 9, 4, 0, own + 10 * unit::deg), 40, 0.3, 3);
    block(w, "IFCWALL", turned(w, 9, 8, 0, own + 20 * unit::deg), 10, 0.3, 3);
    const Import made = import("IFC4", w);
    EXPECT_THAT(made.text, HasSubstr("6.000 m\", C = \"12.000 m\"")) << own;
    EXPECT_THAT(made.text, HasSubstr("width = \"30 cm\"\nheight = \"30 cm\"")) << own;
    EXPECT_EQ(made.report.guessed[0].find("turned by 30.0 deg") != std::string::npos, own > 0) << own;
  }
}

TEST(ImportIfcAngle, OfFewColumnsIsTheBestFittingOne) {
  // at 2 deg these columns stand in two rows and two frames, too, but off them
  Writer w;
  w.metres();
  for (const double x : {0.0, 5.0})
    for (const double y : {0.0, 4.0}) block(w, "IFCCOLUMN", w.placement("$", x, y, 0), 0.3, 0.3, 3);
  block(w, "IFCWALL", turned(w, 2, 2, 0, 2 * unit::deg), 10, 0.3, 3);
  EXPECT_THAT(import("IFC4", w).text, HasSubstr("rows = { A = \"0.000 m\", B = \"5.000 m\" }"));
  // a lone column lies along its own faces
  Writer one;
  one.metres();
  block(one, "IFCCOLUMN", turned(one, 2, 2, 0, 20 * unit::deg), 0.5, 0.3, 3);
  EXPECT_THAT(import("IFC4", one).text, HasSubstr("width = \"50 cm\"\nheight = \"30 cm\""));
}

/// Four columns of 30 cm x 30 cm, 3 m high, at the corners of 5 m x 4 m.
void add_bay(Writer& w) {
  for (const double x : {0.0, 5.0})
    for (const double y : {0.0, 4.0}) block(w, "IFCCOLUMN", w.placement("$", x, y, 0), 0.3, 0.3, 3);
}
std::string loop(Writer& w, const std::vector<std::array<double, 2>>& corners) {
  std::string points;
  for (const auto& c : corners) points += (points.empty() ? "" : ",") + w.point(c[0], c[1], 0);
  return w.add("IFCPOLYLINE((" + points + "," + w.point(corners[0][0], corners[0][1], 0) + "))");
}
std::string slanted(Writer& w, const std::string& profile, const Vec3& way) {
  return w.add("IFCEXTRUDEDAREASOLID(" + profile + ",$," +
               w.add("IFCDIRECTION(" + Writer::tuple({way.x, way.y, way.z}) + ")") + "," + std::to_string(norm(way)) +
               ")");
}

TEST(ImportIfcBoxes, LeaveOutWhatIsTurnedOrInclined) {
  Writer w;
  w.metres();
  add_bay(w);
  block(w, "IFCCOLUMN", turned(w, 10, 0, 0, 45 * unit::deg), 0.3, 0.3, 3);
  w.element("IFCCOLUMN", w.placement("$", 10, 4, 0),
            w.shape("SweptSolid", slanted(w, w.rectangle(0.3, 0.3), {1, 0, 3})));
  block(w, "IFCBEAM", turned(w, 2.5, 2, 2.5, std::atan2(4, 5)), 6.4, 0.3, 0.5);
  block(w, "IFCWALL", turned(w, 2.5, 0, 0, 3 * unit::deg), 5, 0.24, 3);
  // a slab of 20 cm, its profile tilted by 0.2 rad
  const std::string tilt = w.add("IFCDIRECTION((0.,-0.198669,0.980067))");
  const std::string place = w.add("IFCLOCALPLACEMENT($," +
                                  w.add("IFCAXIS2PLACEMENT3D(" + w.point(2.5, 0, 2.2) + "," + tilt + "," +
                                        w.add("IFCDIRECTION((1.,0.,0.))") + ")") +
                                  ")");
  block(w, "IFCSLAB", place, 5, 8, 0.2);
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"5.000 m\" }"));
  EXPECT_THAT(made.report.taken, Contains("4 columns in 1 section"));
  EXPECT_THAT(made.report.missing, Contains("2 x COLUMN: it is turned against the grid, or inclined"));
  for (const char* kind : {"BEAM", "WALL", "SLAB"}) {
    EXPECT_THAT(made.report.missing,
                Contains("1 x " + std::string(kind) + ": it is turned against the grid, or inclined"));
    EXPECT_THAT(made.text, Not(HasSubstr(kind == std::string("BEAM")   ? "[[beams]]"
                                         : kind == std::string("WALL") ? "[[walls]]"
                                                                       : "[[slabs]]")));
  }
}

TEST(ImportIfcBoxes, LeaveOutMeshesOfWallsThatAreTurned) {
  // at 2 deg a wall of 24 cm fills a box of 41 cm to 58 %
  for (const double angle : {0.0, 2 * unit::deg}) {
    Writer w;
    w.metres();
    add_bay(w);
    w.element("IFCWALL", turned(w, 2.5, 0, 0, angle), w.shape("Brep", w.brep(5, 0.24, 3)));
    const Import made = import("IFC4", w);
    EXPECT_EQ(made.text.find("[wall.wall_240") != std::string::npos, angle == 0);
    EXPECT_EQ(made.text.find("[wall.") != std::string::npos, angle == 0);
  }
}

TEST(ImportIfcBoxes, LeaveOutProfilesThatDoNotFillThem) {
  Writer w;
  w.metres();
  add_bay(w);
  const std::string outer = loop(w, {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}});
  const std::string inner = loop(w, {{-0.4, -0.4}, {0.4, -0.4}, {0.4, 0.4}, {-0.4, 0.4}});
  const std::string angle = loop(w, {{-0.5, -0.5}, {0.5, -0.5}, {0.5, -0.4}, {-0.4, -0.4}, {-0.4, 0.5}, {-0.5, 0.5}});
  for (const std::string& profile : {"IFCARBITRARYPROFILEDEFWITHVOIDS(.AREA.,$," + outer + ",(" + inner + "))",
                                     "IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + angle + ")"})
    w.element("IFCCOLUMN", w.placement("$", 10, 0, 0), w.shape("SweptSolid", w.extrusion(w.add(profile), 3)));
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.taken, Contains("4 columns in 1 section"));
  EXPECT_THAT(made.report.missing, Contains("2 x COLUMN: its profile does not fill its box"));
}

TEST(ImportIfcBoxes, OfRoundColumnsDoNotDependOnTheirTurn) {
  Writer w;
  w.metres();
  add_bay(w);
  w.element("IFCCOLUMN", turned(w, 10, 0, 0, 45 * unit::deg),
            w.shape("SweptSolid", w.extrusion(w.add("IFCCIRCLEPROFILEDEF(.AREA.,$,$,0.2)"), 3)));
  // sqrt(pi) 20 cm = 35.4 cm
  EXPECT_THAT(import("IFC4", w).text, HasSubstr("width = \"35.4 cm\"\nheight = \"35.4 cm\""));
  // outlined by a circle, whose corners lie on it
  for (const double angle : {0.0, 11.25, 20.0, 45.0}) {
    Writer c;
    c.metres();
    add_bay(c);
    const std::string at = c.add("IFCAXIS2PLACEMENT2D(" + c.point(0, 0, 0) + ",$)"),
                      circle = c.add("IFCCIRCLE(" + at + ",0.25)"),
                      outline = c.add("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + circle + ")");
    c.element("IFCCOLUMN", turned(c, 10, 0, 0, angle * unit::deg), c.shape("SweptSolid", c.extrusion(outline, 3)));
    // sqrt(pi) 25 cm = 44.3 cm
    EXPECT_THAT(import("IFC4", c).text, HasSubstr("width = \"44.3 cm\"\nheight = \"44.3 cm\"")) << angle;
  }
}

TEST(ImportIfcBoxes, GiveWayToTheOutlinesOfSlabs) {
  Writer w;
  w.metres();
  for (const double x : {0.0, 5.0, 10.0})
    for (const double y : {0.0, 4.0, 8.0}) block(w, "IFCCOLUMN", w.placement("$", x, y, 0), 0.3, 0.3, 3);
  // without the cell from 5 m, 4 m, and with a hole in that from 0 m, 4 m
  const std::string outline = loop(w, {{0, 0}, {10, 0}, {10, 4}, {5, 4}, {5, 8}, {0, 8}});
  const std::string hole = loop(w, {{1, 5}, {4, 5}, {4, 7}, {1, 7}});
  w.element(
      "IFCSLAB", w.placement("$", 0, 0, 2.8),
      w.shape("SweptSolid",
              w.extrusion(w.add("IFCARBITRARYPROFILEDEFWITHVOIDS(.AREA.,$," + outline + ",(" + hole + "))"), 0.2)));
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("thickness = \"20 cm\""));
  EXPECT_THAT(made.text, HasSubstr("at = [\"A1B2\", \"B1C2\"]"));
}

/// A prism of faces over an outline that runs against the clock.
std::string prism(Writer& w, const std::vector<std::array<double, 2>>& outline, double height) {
  std::vector<std::string> low, high;
  for (const auto& c : outline) low.push_back(w.point(c[0], c[1], 0)), high.push_back(w.point(c[0], c[1], height));
  std::vector<std::string> loops(2);
  const size_t n = outline.size();
  for (size_t i = 0; i < n; ++i) {
    loops[0] += (i > 0 ? "," : "") + low[n - 1 - i], loops[1] += (i > 0 ? "," : "") + high[i];
    const size_t next = (i + 1) % n;
    loops.push_back(low[i] + "," + low[next] + "," + high[next] + "," + high[i]);
  }
  std::string faces;
  for (const std::string& corners : loops)
    faces +=
        (faces.empty() ? "" : ",") +
        w.add("IFCFACE((" + w.add("IFCFACEOUTERBOUND(" + w.add("IFCPOLYLOOP((" + corners + "))") + ",.T.)") + "))");
  return w.add("IFCFACETEDBREP(" + w.add("IFCCLOSEDSHELL((" + faces + "))") + ")");
}
std::vector<std::array<double, 2>> polygon(int corners, double radius) {
  std::vector<std::array<double, 2>> out;
  for (int i = 0; i < corners; ++i) {
    const double a = (i + 0.5) * 360 / corners * unit::deg;
    out.push_back({radius * std::cos(a), radius * std::sin(a)});
  }
  return out;
}

TEST(ImportIfcBoxes, OfRoundMeshesHoldCirclesOnly) {
  const auto made_of = [](const std::vector<std::array<double, 2>>& outline) {
    Writer w;
    w.metres();
    add_bay(w);
    w.element("IFCCOLUMN", w.placement("$", 10, 0, 0), w.shape("Brep", prism(w, outline, 3)));
    return import("IFC4", w);
  };
  // sqrt(pi) 20 cm = 35.4 cm around a twelve-sided one
  EXPECT_THAT(made_of(polygon(12, 0.2)).text, HasSubstr("width = \"35.4 cm\""));
  // an angle whose legs are half as thick as wide, and a cross, fill as much of their box
  for (const std::vector<std::array<double, 2>>& outline :
       {std::vector<std::array<double, 2>>{{-0.2, -0.2}, {0.2, -0.2}, {0.2, 0}, {0, 0}, {0, 0.2}, {-0.2, 0.2}},
        {{-0.107, -0.2},
         {0.107, -0.2},
         {0.107, -0.107},
         {0.2, -0.107},
         {0.2, 0.107},
         {0.107, 0.107},
         {0.107, 0.2},
         {-0.107, 0.2},
         {-0.107, 0.107},
         {-0.2, 0.107},
         {-0.2, -0.107},
         {-0.107, -0.107}}}) {
    EXPECT_THAT(made_of(outline).report.missing, Contains("1 x COLUMN: its body is a mesh that is no upright box"));
  }
}

TEST(ImportIfcBoxes, OfMeshesThatOverlapAreNone) {
  Writer w;
  w.metres();
  add_bay(w);
  w.element("IFCCOLUMN", w.placement("$", 10, 0, 0), w.shape("Brep", w.brep(0.4, 0.4, 3) + "," + w.brep(0.4, 0.4, 3)));
  EXPECT_THAT(import("IFC4", w).report.missing,
              Contains("1 x COLUMN: its body is a mesh that overlaps itself, or is not closed"));
}

TEST(ImportIfcAngle, IsNotThatOfRoundMeshes) {
  for (const int corners : {16, 24, 36, 72}) {
    Writer w;
    w.metres();
    for (const double x : {0.0, 5.0})
      for (const double y : {0.0, 6.0})
        w.element("IFCCOLUMN", w.placement("$", x, y, 0), w.shape("Brep", prism(w, polygon(corners, 0.2), 3)));
    EXPECT_THAT(import("IFC4", w).text, HasSubstr("rows = { A = \"0.000 m\", B = \"5.000 m\" }")) << corners;
  }
}

TEST(ImportIfcBoxes, OfSlabsAreThatOfTheirPlate) {
  /// A plate of 5 m x 4 m x 20 cm with its underside at 2.8 m, and a box more.
  const auto made_with = [](double x, double y, double z, double at) {
    Writer w;
    w.metres();
    add_bay(w);
    const auto box = [&w](double a, double b, double c, double low) {
      return w.add("IFCEXTRUDEDAREASOLID(" + w.rectangle(a, b) + "," +
                   w.add("IFCAXIS2PLACEMENT3D(" + w.point(2.5, 2, low) + ",$,$)") + "," +
                   w.add("IFCDIRECTION((0.,0.,1.))") + "," + std::to_string(c) + ")");
    };
    w.element("IFCSLAB", w.placement("$", 0, 0, 2.8),
              w.shape("SweptSolid", box(5, 4, 0.2, 0) + "," + box(x, y, z, at)));
    return import("IFC4", w);
  };
  // a rib below, a kerb above
  const Import rib = made_with(5, 0.3, 0.4, -0.4), kerb = made_with(5, 0.15, 0.5, 0.2);
  for (const Import& made : {rib, kerb}) {
    EXPECT_THAT(made.text, HasSubstr("thickness = \"20 cm\""));
    EXPECT_THAT(made.report.guessed, Contains(HasSubstr("1 slab of several parts: the plate was taken, ")));
    EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("moved to their floors"))));
  }
  // 4 of 4.6 m3
  EXPECT_THAT(rib.report.guessed, Contains(HasSubstr(" 87 % of the volume at least (#")));
  // a topping of 14 cm on planks of 6 would be one plate, as 20 cm and 4 cm more are
  const Import layers = made_with(5, 4, 0.04, 0.2);
  EXPECT_THAT(layers.text, HasSubstr("thickness = \"24 cm\""));
  EXPECT_THAT(layers.report.guessed, Not(Contains(HasSubstr("of several parts"))));
  // two plates one above the other
  EXPECT_THAT(made_with(5, 4, 0.2, -0.5).report.missing,
              Contains("1 x SLAB: its parts have several thicknesses, or lie at several heights"));
}

TEST(ImportIfcWalls, WithRecessesInTheirOwnOutlineAreTold) {
  const auto made_of = [](const std::vector<std::array<double, 2>>& outline) {
    Writer w;
    w.metres();
    add_bay(w);
    const std::string profile = w.add("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + loop(w, outline) + ")");
    w.element("IFCWALL", w.placement("$", 0, 0, 0), w.shape("SweptSolid", w.extrusion(profile, 3)));
    return import("IFC4", w);
  };
  // 0.2 m thick with pilasters of 0.4 m
  const Import made =
      made_of({{0.15, -0.1}, {4.85, -0.1}, {4.85, 0.1}, {3.5, 0.1}, {3.5, 0.3}, {2.5, 0.3}, {2.5, 0.1}, {0.15, 0.1}});
  EXPECT_THAT(made.text, HasSubstr("thickness = \"40 cm\""));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("1 wall fills only a part of the box around, 61 % at least (#")));
  EXPECT_THAT(made_of({{0.15, -0.1}, {4.85, -0.1}, {4.85, 0.1}, {0.15, 0.1}}).report.guessed,
              Not(Contains(HasSubstr("part of the box"))));
}

TEST(ImportIfcStoreys, OfWhichThereIsOneStandWhereItIsPlaced) {
  Writer w;
  w.metres();
  for (const double x : {0.0, 5.0})
    for (const double y : {0.0, 4.0}) block(w, "IFCCOLUMN", w.placement("$", x, y, 0), 0.3, 0.3, 2.8);
  block(w, "IFCSLAB", w.placement("$", 2.5, 2, 2.8), 5, 4, 0.2);
  w.add("IFCBUILDINGSTOREY('g',$,'1',$,$," + w.placement("$", 0, 0, 3) + ",$,$,.ELEMENT.,3.)");
  EXPECT_THAT(import("IFC4", w).text, HasSubstr("heights = [\"3.000 m\"]"));
}

TEST(ImportIfcPlaces, HoldTheLargerOfTwoElements) {
  Writer w;
  w.metres();
  add_bay(w);
  block(w, "IFCCOLUMN", w.placement("$", 0.1, 0.1, 0), 0.4, 0.4, 3);   // larger than the one there
  block(w, "IFCCOLUMN", w.placement("$", 5.05, 0, 0), 0.25, 0.25, 3);  // smaller
  block(w, "IFCSLAB", w.placement("$", 2.5, 2, 2.8), 5, 4, 0.2);
  block(w, "IFCSLAB", w.placement("$", 2.5, 2, 3), 5, 4, 0.08);  // screed
  block(w, "IFCWALL", w.placement("$", 2.5, 0, 0), 5, 0.115, 3);
  block(w, "IFCWALL", w.placement("$", 2.5, 0.2, 0), 5, 0.24, 3);
  block(w, "IFCBEAM", w.placement("$", 2.5, 4, 2.5), 5, 0.3, 0.5);
  block(w, "IFCBEAM", w.placement("$", 2.5, 4.3, 2.5), 5, 0.3, 0.5);  // as large
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.taken, Contains("4 columns in 2 sections"));
  EXPECT_THAT(made.report.taken, Contains("1 slab in 1 thickness"));
  EXPECT_THAT(made.report.taken, Contains("1 wall in 1 thickness"));
  EXPECT_THAT(made.report.taken, Contains("1 beam in 1 section"));
  EXPECT_THAT(made.report.guessed, Contains("2 places have several columns: the larger one was taken"));
  EXPECT_THAT(made.report.guessed, Contains("1 place has several slabs: the thicker one was taken"));
  EXPECT_THAT(made.report.guessed, Contains("1 place has several walls: the thicker one was taken"));
  EXPECT_THAT(made.report.guessed, Contains("1 place has several beams: the larger one was taken"));
  EXPECT_THAT(made.report.missing, Contains("2 x COLUMN: another one stands in its place"));
  for (const char* kind : {"SLAB", "WALL", "BEAM"})
    EXPECT_THAT(made.report.missing, Contains("1 x " + std::string(kind) + ": another one stands in its place"));
  EXPECT_THAT(made.text, HasSubstr("section = \"column_400x400_unknown\"\nstoreys = 0\nat = [\"A1\"]"));
  EXPECT_THAT(made.text, Not(HasSubstr("250x250")));
  EXPECT_THAT(made.text, HasSubstr("[slab.slab_200"));
  EXPECT_THAT(made.text, Not(HasSubstr("[slab.slab_80")));
  EXPECT_THAT(made.text, HasSubstr("[wall.wall_240"));
  EXPECT_THAT(made.text, Not(HasSubstr("[wall.wall_115")));
}

TEST(ImportIfcPlaces, TakeColumnsThatGoOnWhereOthersEnd) {
  Writer w;
  w.metres();
  for (const double z : {0.0, 1.5})
    for (const double x : {0.0, 5.0}) block(w, "IFCCOLUMN", w.placement("$", x, 0, z), 0.3, 0.3, 1.5);
  w.add("IFCBUILDINGSTOREY('g',$,'S',$,$," + w.placement("$", 0, 0, 0) + ",$,$,.ELEMENT.,0.)");
  w.add("IFCBUILDINGSTOREY('g',$,'S',$,$," + w.placement("$", 0, 0, 3) + ",$,$,.ELEMENT.,3.)");
  block(w, "IFCCOLUMN", w.placement("$", 10, 0, 0), 0.3, 0.3, 6);
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.taken, Contains("5 columns in 1 section"));
  EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("were moved"))));
  EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("several columns"))));
}

TEST(ImportIfcPlaces, TellHowFarColumnsAreMovedToTheirRow) {
  Writer w;
  w.metres();
  for (const double y : {0.0, 4.0}) {
    block(w, "IFCCOLUMN", w.placement("$", 0, y, 0), 0.3, 0.3, 3);
    block(w, "IFCCOLUMN", w.placement("$", y > 0 ? 6.1 : 6, y, 0), 0.3, 0.3, 3);
  }
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"6.050 m\" }"));
  EXPECT_THAT(made.report.taken,
              Contains("2 rows by 2 frames and 1 storey, from the places of 4 columns and 0 storeys of the file"));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("columns were moved by up to 5.0 cm (#")));
}

TEST(ImportIfcPlaces, TellWhatIsMovedAndCompleted) {
  Writer w;
  w.metres();
  for (const double x : {0.0, 6.0})
    for (const double y : {0.0, 5.0}) block(w, "IFCCOLUMN", w.placement("$", x, y, 0), 0.4, 0.4, 3);
  const std::string half = block(w, "IFCWALL", w.placement("$", 1.85, 0, 0), 3.7, 0.2, 3);
  const std::string low = block(w, "IFCWALL", w.placement("$", 3, 5.55, 0), 6, 0.2, 1.6);
  const std::string beside = block(w, "IFCBEAM", w.placement("$", 3, 0.55, 2.1), 6, 0.3, 0.5);
  block(w, "IFCBEAM", w.placement("$", 1.85, 5, 1.95), 3.7, 0.3, 0.5);  // a cantilever
  const std::string slab = block(w, "IFCSLAB", w.placement("$", 3, 2.5, 2.7), 6, 5, 0.2);
  const Import made = import("IFC4", w);
  // between the columns 3.5 m of 5.6 m, and 1.6 m below a slab of 20 cm
  EXPECT_THAT(made.report.guessed,
              Contains("1 wall fills only a part of its bay, 62 % at least (" + half + "): it was completed"));
  EXPECT_THAT(made.report.guessed,
              Contains("1 wall fills only a part of its storey, 57 % at least (" + low + "): it was completed"));
  EXPECT_THAT(made.report.guessed, Contains("walls were moved to their lines by up to 55.0 cm (" + low + ")"));
  EXPECT_THAT(made.report.guessed, Contains("beams were moved to their lines by up to 55.0 cm (" + beside + ")"));
  EXPECT_THAT(made.report.guessed, Contains("beams were moved to their floors by up to 40.0 cm (" + beside + ")"));
  EXPECT_THAT(made.report.guessed, Contains("slabs were moved to their floors by up to 10.0 cm (" + slab + ")"));
  EXPECT_THAT(made.report.taken, Contains("1 beam in 1 section"));
  EXPECT_THAT(made.report.missing,
              Contains("1 x BEAM: one end of it is far from the grid's points, as of a cantilever"));
}

TEST(ImportIfcPlaces, AreThoseOfElementsThatFillThemWithoutAWord) {
  Writer w;
  w.metres();
  for (const double x : {0.0, 6.0}) {
    block(w, "IFCCOLUMN", w.placement("$", x, 0, 0), 0.4, 0.4, 2.5);  // below the beam
    block(w, "IFCCOLUMN", w.placement("$", x, 5, 0), 0.4, 0.4, 3);
    for (const double z : {0.0, 1.5})  // one wall in two lifts
      block(w, "IFCWALL", w.placement("$", x, 2.5, z), 0.2, 4.6, 1.5);
  }
  block(w, "IFCWALL", w.placement("$", 3, 0, 0), 5.6, 0.2, 2.5);
  block(w, "IFCBEAM", w.placement("$", 3, 0, 2.5), 5.6, 0.3, 0.5);
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.taken, Contains("5 walls in 1 thickness"));
  EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("completed"))));
  EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("moved"))));
}

/// A column whose body is mapped by the given operator.
void add_mapped(Writer& w, double x, double y, const std::string& body, const std::string& target) {
  const std::string map = w.add("IFCREPRESENTATIONMAP(" + w.add("IFCAXIS2PLACEMENT3D(" + w.point(0, 0, 0) + ",$,$)") +
                                "," + w.add("IFCSHAPEREPRESENTATION($,'Body','SweptSolid',(" + body + "))") + ")");
  w.element("IFCCOLUMN", w.placement("$", x, y, 0),
            w.shape("MappedRepresentation", w.add("IFCMAPPEDITEM(" + map + "," + w.add(target) + ")")));
}

TEST(ImportIfcMaps, ScaleAndMirrorBodies) {
  Writer w;
  w.metres();
  const std::string zero = w.point(0, 0, 0);
  const auto body = [&w](double h) { return w.extrusion(w.rectangle(0.3, 0.2), h); };
  add_mapped(w, 0, 0, body(1.5), "IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$," + zero + ",2.,$)");
  add_mapped(w, 5, 0, body(3), "IFCCARTESIANTRANSFORMATIONOPERATOR3DNONUNIFORM($,$," + zero + ",1.,$,3.,1.)");
  // mirrored: x to -x; the body lies beside its origin
  const std::string left = w.add("IFCDIRECTION((-1.,0.,0.))"), back = w.add("IFCDIRECTION((0.,1.,0.))"),
                    up = w.add("IFCDIRECTION((0.,0.,1.))");
  const std::string beside = w.add("IFCRECTANGLEPROFILEDEF(.AREA.,$," +
                                   w.add("IFCAXIS2PLACEMENT2D(" + w.point(1, 0, 0) + ",$)") + ",0.4,0.4)");
  add_mapped(w, 11, 4, w.extrusion(beside, 3),
             "IFCCARTESIANTRANSFORMATIONOPERATOR3D(" + left + "," + back + "," + zero + ",1.," + up + ")");
  // and a mirrored mesh
  add_mapped(w, 0, 4, w.triangulated(0.5, 0.5, 3),
             "IFCCARTESIANTRANSFORMATIONOPERATOR3D(" + left + "," + back + "," + zero + ",$," + up + ")");
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"5.000 m\", C = \"10.000 m\" }"));
  EXPECT_THAT(made.text, HasSubstr("heights = [\"3.000 m\"]"));
  for (const char* at :
       {"600x400_unknown\"\nstoreys = 0\nat = [\"A1\"]", "300x600_unknown\"\nstoreys = 0\nat = [\"B1\"]",
        "400x400_unknown\"\nstoreys = 0\nat = [\"C2\"]", "500x500_unknown\"\nstoreys = 0\nat = [\"A2\"]"})
    EXPECT_THAT(made.text, HasSubstr(at));
}

TEST(ImportIfcMaps, ScaleAndMirrorProfiles) {
  Writer w;
  w.metres();
  add_bay(w);
  const std::string profile = w.rectangle(0.2, 0.3), zero = w.add("IFCCARTESIANPOINT((0.,0.))");
  const std::string twice = w.add("IFCCARTESIANTRANSFORMATIONOPERATOR2D($,$," + zero + ",2.)");
  w.element(
      "IFCCOLUMN", w.placement("$", 10, 0, 0),
      w.shape("SweptSolid", w.extrusion(w.add("IFCDERIVEDPROFILEDEF(.AREA.,$," + profile + "," + twice + ",$)"), 3)));
  EXPECT_THAT(import("IFC4", w).text, HasSubstr("width = \"40 cm\"\nheight = \"60 cm\""));
}

TEST(ImportIfcPlacements, ThatAreNotUnderstoodLeaveTheirElementsOut) {
  Writer w;
  w.metres();
  add_bay(w);
  const std::string grid = w.add("IFCGRIDPLACEMENT(#9999,$)");
  const std::string axes = w.add("IFCAXIS2PLACEMENT3D(" + w.point(1, 1, 0) + ",$,$)");
  for (const std::string& place : {std::string("$"), grid, std::string("#99999"), w.add("IFCLOCALPLACEMENT($,#99999)"),
                                   w.add("IFCLOCALPLACEMENT(" + grid + "," + axes + ")"),
                                   w.add("IFCLOCALPLACEMENT($," + w.add("IFCAXIS2PLACEMENT3D($,$,$)") + ")")})
    block(w, "IFCCOLUMN", place, 0.5, 0.5, 3);
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.taken, Contains("4 columns in 1 section"));
  EXPECT_THAT(made.report.missing, Contains("6 x COLUMN: its placement is not understood"));
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"5.000 m\" }"));
}

TEST(ImportIfcPlacements, OfBodiesHaveToBeUnderstoodToo) {
  Writer w;
  w.metres();
  add_bay(w);
  const std::string up = w.add("IFCDIRECTION((0.,0.,1.))"), profile = w.rectangle(0.5, 0.5);
  for (const std::string& rest : {"#99999," + up + ",3.", "$," + up + ",0.", "$," + up + ",'3.'"})
    w.element("IFCCOLUMN", w.placement("$", 1, 1, 0),
              w.shape("SweptSolid", w.add("IFCEXTRUDEDAREASOLID(" + profile + "," + rest + ")")));
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.taken, Contains("4 columns in 1 section"));
  EXPECT_THAT(made.report.missing, Contains("1 x COLUMN: the placement of its body is not understood"));
  EXPECT_THAT(made.report.missing, Contains("2 x COLUMN: its body has no volume"));
}

TEST(ImportIfcCoordinates, ThatAreNoNumbersAreRefusedWithTheirLine) {
  for (const char* wrong : {"IFCCARTESIANPOINT(('1.',0.,0.))", "IFCCARTESIANPOINT(($,0.,0.))", "IFCCARTESIANPOINT($)",
                            "IFCDIRECTION((.X.,0.,1.))", "IFCCARTESIANPOINTLIST3D(((0.,0.,0.),(0.,'a',0.)),$)"}) {
    Writer w;
    w.metres();
    w.add(wrong);
    try {
      (void)import("IFC4", w);
      ADD_FAILURE() << wrong;
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E111") << wrong;
      EXPECT_EQ(e.diagnostics()[0].where.line, 8) << wrong;
      EXPECT_EQ(e.diagnostics()[0].where.column, 1) << wrong;
      EXPECT_EQ(e.diagnostics()[0].message, "a coordinate of #3 is no number") << wrong;
    }
  }
}

TEST(ImportIfcStoreys, EndAtTheLastFloorNotAtParapetsOrBelowSlabs) {
  const auto heights = [](double top, const std::vector<double>& storeys) {
    Writer w;
    w.metres();
    for (const double z : storeys)
      w.add("IFCBUILDINGSTOREY('g',$,'S',$,$," + w.placement("$", 0, 0, z) + ",$,$,.ELEMENT.," + std::to_string(z) +
            ")");
    for (const double x : {0.0, 5.0}) block(w, "IFCCOLUMN", w.placement("$", x, 0, 0), 0.3, 0.3, top);
    block(w, "IFCBEAM", w.placement("$", 2.5, 0, 5.5), 5, 0.3, 0.5);
    const Import made = import("IFC4", w);
    const size_t at = made.text.find("heights = "), beams = made.text.find("[[beams]]");
    return made.text.substr(at + 10, made.text.find("\n", at) - at - 10) +
           (beams == std::string::npos ? " no beam" : "");
  };
  EXPECT_EQ(heights(6, {0, 3, 6}), "[\"3.000 m\", \"3.000 m\"]");
  EXPECT_EQ(heights(6.9, {0, 3, 6}), "[\"3.000 m\", \"3.000 m\"]") << "a parapet";
  EXPECT_EQ(heights(5.8, {0, 3, 6}), "[\"3.000 m\", \"3.000 m\"]") << "the slab lies on the columns";
  EXPECT_EQ(heights(6, {0, 3}), "[\"3.000 m\", \"3.000 m\"]") << "no storey at the roof";
  EXPECT_EQ(heights(6, {0, 3, 3.4, 9}), "[\"3.000 m\", \"3.000 m\"]");
  EXPECT_EQ(heights(6, {0, 1, 5, 6}), "[\"1.000 m\", \"4.000 m\", \"1.000 m\"]") << "as low as a plan has them";
  EXPECT_EQ(heights(6, {0, 3, 3.999, 6}), "[\"3.000 m\", \"3.000 m\"]");
}

/// Beams of a frame of two storeys over the rows x = 0, 5 and 10 and the frames y = 0 and 6 without the column B2.
Import import_beams(const std::vector<std::array<double, 5>>& beams, bool has_wall = false) {
  Writer w;
  w.metres();
  for (const double z : {0.0, 3.0}) {
    for (const double x : {0.0, 5.0, 10.0})
      for (const double y : {0.0, 6.0})
        if (x != 5 || y != 6) block(w, "IFCCOLUMN", w.placement("$", x, y, z), 0.3, 0.3, 3);
    if (has_wall) block(w, "IFCWALL", w.placement("$", 7.5, 6, z), 5, 0.2, 3);
  }
  for (const auto& [x, y, z, along_x, along_y] : beams)
    block(w, "IFCBEAM", w.placement("$", x, y, z - 0.5), along_x, along_y, 0.5);
  return import("IFC4", w);
}

TEST(ImportIfcBeams, ThatHangInTheAirAreLeftOut) {
  const auto at = [](const Import& made) {
    const size_t rule = made.text.find("[[beams]]"), from = made.text.find("at = ", rule);
    return rule == std::string::npos ? "" : made.text.substr(from + 5, made.text.find("\n", from) - from - 5);
  };
  const std::string why = " x BEAM: hangs in the air: no column or wall stands below its end";
  const std::array<double, 5> a1a2{0, 3, 3, 0.3, 6}, b1b2{5, 3, 3, 0.3, 6}, a2b2{2.5, 6, 3, 5, 0.3},
      b2c2{7.5, 6, 3, 5, 0.3}, b1b2_above{5, 3, 6, 0.3, 6}, a1c1{5, 0, 3, 10, 0.3}, a2c2{5, 6, 3, 10, 0.3};
  const Import one = import_beams({a1a2, b1b2, b1b2_above});
  EXPECT_EQ(at(one), "[\"A1A2\"]");
  EXPECT_THAT(one.report.missing, Contains("2" + why));
  EXPECT_THAT(one.report.taken, Contains("1 beam in 1 section"));
  // on other beams that are carried, of one element or of several
  EXPECT_EQ(at(import_beams({a2c2})), "[\"A2B2\", \"B2C2\"]");
  const Import carried = import_beams({a2b2, b2c2, b1b2, a1c1});
  EXPECT_EQ(at(carried), "[\"A1B1\", \"A2B2\", \"B1B2\", \"B1C1\", \"B2C2\"]");
  EXPECT_THAT(carried.report.missing, Not(Contains(HasSubstr("BEAM"))));
  // not on beams of another floor
  EXPECT_THAT(import_beams({a2c2, b1b2_above}).report.missing, Contains("1" + why));
  // on the end of a wall
  EXPECT_EQ(at(import_beams({b1b2}, true)), "[\"B1B2\"]");
  // none of two that share a place
  EXPECT_THAT(import_beams({b1b2, b1b2}).report.missing, Contains("2" + why));
  EXPECT_EQ(at(import_beams({b1b2, b1b2})), "");
}

TEST(ImportIfcBeams, LoseTheSpansThatHangInTheAir) {
  // three spans along a row whose last column is missing
  Writer w;
  w.metres();
  for (const double x : {0.0, 5.0, 10.0, 15.0})
    for (const double y : {0.0, 6.0})
      if (x != 15 || y != 6) block(w, "IFCCOLUMN", w.placement("$", x, y, 0), 0.3, 0.3, 3);
  block(w, "IFCBEAM", w.placement("$", 7.5, 6, 2.5), 15, 0.3, 0.5);
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("at = [\"A2B2\", \"B2C2\"]"));
  EXPECT_THAT(made.report.taken, Contains("1 beam in 1 section"));
  EXPECT_THAT(made.report.missing,
              Contains("1 x BEAM: a span of it hangs in the air: no column or wall stands below its end"));
}

TEST(ImportIfcBeams, StandOnlyBetweenPointsOfTheGrid) {
  // columns of 30 cm at x = 0, 5 and 10, and of 2 m along the row y = 6
  const auto spans = [](double from, double to, double y = 0) {
    Writer w;
    w.metres();
    for (const double x : {0.0, 5.0, 10.0}) {
      block(w, "IFCCOLUMN", w.placement("$", x, 0, 0), 0.3, 0.3, 3);
      block(w, "IFCCOLUMN", w.placement("$", x, 6, 0), 2, 0.3, 3);
    }
    block(w, "IFCBEAM", w.placement("$", 0.5 * (from + to), y, 2.5), to - from, 0.3, 0.5);
    const Import made = import("IFC4", w);
    const size_t rule = made.text.find("[[beams]]"), at = made.text.find("at = ", rule);
    std::string out = rule == std::string::npos ? "" : made.text.substr(at + 5, made.text.find("\n", at) - at - 5);
    for (const std::string& s : made.report.missing)
      if (s.find("BEAM") != std::string::npos) out += " " + s.substr(s.find(": ") + 2);
    return out;
  };
  const std::string none = " one end of it is far from the grid's points, as of a cantilever",
                    part = " a part of it stands out beyond the last grid point, as a cantilever";
  EXPECT_EQ(spans(0.15, 4.85), "[\"A1B1\"]");
  EXPECT_EQ(spans(0.5, 4.5), "[\"A1B1\"]");
  EXPECT_EQ(spans(0, 3.7), none);
  EXPECT_EQ(spans(-2, 5), "[\"A1B1\"]" + part);
  EXPECT_EQ(spans(0, 8.5), "[\"A1B1\"]" + part);
  EXPECT_EQ(spans(0, 9.5), "[\"A1B1\", \"B1C1\"]");
  EXPECT_EQ(spans(0.95, 4.05, 6), "[\"A2B2\"]") << "at the faces of wide columns";
  EXPECT_EQ(spans(0.95, 4.05, 0), none);
}

TEST(ImportIfcBeams, StandBelowTheNearestFloor) {
  Writer w;
  w.metres();
  for (const double z : {0.0, 3.0, 4.0, 7.0})
    w.add("IFCBUILDINGSTOREY('g',$,'S',$,$," + w.placement("$", 0, 0, z) + ",$,$,.ELEMENT.," + std::to_string(z) + ")");
  for (const double x : {0.0, 5.0}) block(w, "IFCCOLUMN", w.placement("$", x, 0, 0), 0.3, 0.3, 7);
  block(w, "IFCBEAM", w.placement("$", 2.5, 0, 3.15), 5, 0.3, 0.4);  // 45 cm below 4 m, 55 cm above 3 m
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("[[beams]]\nsection = \"beam_300x400_unknown\"\nstoreys = 1\n"));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("beams were moved to their floors by up to 45.0 cm (#")));
}

TEST(ImportIfcKinds, ThatAreNotTakenAreCounted) {
  Writer w;
  w.metres();
  add_bay(w);
  block(w, "IFCBUILDINGELEMENTPROXY", w.placement("$", 0, 0, 0), 1, 1, 1);
  block(w, "IFCPLATE", w.placement("$", 0, 0, 0), 1, 1, 1);
  block(w, "IFCPLATESTANDARDCASE", w.placement("$", 0, 0, 0), 1, 1, 1);
  w.element("IFCRAMP", w.placement("$", 0, 0, 0), "$");
  const std::string desk = w.element("IFCFURNISHINGELEMENT", "$", "$"), grid = w.element("IFCGRID", "$", "$");
  const std::string door = w.element("IFCDOOR", "$", "$"), member = w.element("IFCMEMBER", "$", "$");
  w.add("IFCRELCONTAINEDINSPATIALSTRUCTURE('g',$,$,$,(" + desk + "," + grid + "," + door + "," + member + "),#99999)");
  block(w, "IFCWALLELEMENTEDCASE", w.placement("$", 2.5, 0, 0), 5, 0.24, 3);
  block(w, "IFCCOLUMN", "$", 0.5, 0.5, 3);
  const Import made = import("IFC4", w);
  for (const char* kind :
       {"1 x BUILDINGELEMENTPROXY", "2 x PLATE", "1 x RAMP", "1 x FURNISHINGELEMENT", "1 x DOOR", "1 x MEMBER"})
    EXPECT_THAT(made.report.missing, Contains(std::string(kind) + ": is not taken"));
  EXPECT_THAT(made.report.missing, Not(Contains(HasSubstr("GRID"))));
  EXPECT_THAT(made.report.missing, Contains("1 x COLUMN: its placement is not understood")) << "once";
  EXPECT_THAT(made.report.taken, Contains("1 wall in 1 thickness"));
}

}  // namespace
}  // namespace topple::product
