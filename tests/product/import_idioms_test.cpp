// Small files in the ways in which CAD programs write buildings: meshes instead of extrusions, bars in assemblies and
// of types, storeys that only their placements know, profiles along indexed and composite curves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <vector>

#include "base/error.h"
#include "ifc_writer.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// The same, and one of 0.5 m x 0.4 m beside them through both storeys, whose reference it gives.
std::string add_columns_and_a_long_one(Writer& w) {
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  return w.element("IFCCOLUMN", w.placement("$", 12, 0, 0),
                   w.shape("SweptSolid", w.extrusion(w.rectangle(0.5, 0.4), 6)));
}

TEST(ImportIfcIdioms, FindsBoxesInMeshesAndStoreysByTheirPlacement) {
  Writer w;
  w.metres();
  // the site lies at 112 m; elevations count from the building's zero
  const std::string site = w.placement("$", 3500000, 5600000, 112);
  for (const double z : {0.0, 3.0})
    w.add("IFCBUILDINGSTOREY('g',$,'S',$,$," + w.placement(site, 0, 0, z) + ",$,$,.ELEMENT.," + std::to_string(z) +
          ")");
  add_columns(w, site, [&] { return w.shape("Tessellation", w.triangulated(0.4, 0.3, 3)); });
  w.element("IFCBEAM", w.placement(site, 3, 0, 2.4), w.shape("Brep", w.brep(6, 0.25, 0.6)));
  w.element("IFCBEAM", w.placement(site, 3, 5, 2.4), w.shape("Brep", w.brep(6, 0.25, 0.6, 0.5)));  // haunched
  // a slab along an indexed curve
  const std::string list = w.add("IFCCARTESIANPOINTLIST2D(((0.,0.),(6.,0.),(6.,5.),(0.,5.),(0.,0.)))");
  const std::string curve = w.add("IFCINDEXEDPOLYCURVE(" + list + ",(IFCLINEINDEX((1,2,3,4,5))),.F.)");
  w.element("IFCSLAB", w.placement(site, 0, 0, 2.8),
            w.shape("SweptSolid", w.extrusion(w.add("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + curve + ")"), 0.2)));
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("heights = [\"3.000 m\", \"3.000 m\"]"));
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"6.000 m\" }"));
  EXPECT_THAT(made.text, HasSubstr("width = \"40 cm\"\nheight = \"30 cm\""));
  EXPECT_THAT(made.text, HasSubstr("thickness = \"20 cm\""));
  EXPECT_THAT(made.text, HasSubstr("at = [\"A1B1\"]"));
  EXPECT_THAT(made.report.taken, Contains(HasSubstr("1 beam in")));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("9 elements are meshes")));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("1 x BEAM: its body is a mesh that is no upright box")));
}

TEST(ImportIfcIdioms, TakesFloorsFromColumnsWhereThereAreNoStoreys) {
  Writer w;
  w.metres();
  w.add("IFCBUILDINGSTOREY('g',$,'Undefined',$,$,$,$,$,.ELEMENT.,0.)");
  add_columns(w, "$", [&] { return w.shape("Brep", w.brep(0.4, 0.4, 3)); });
  const Import made = import("IFC2X3", w);
  EXPECT_THAT(made.text, HasSubstr("heights = [\"3.000 m\", \"3.000 m\"]"));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("floors are where columns end")));
}

TEST(ImportIfcIdioms, CountsBarsOfGroupsInAssembliesByTheirShape) {
  Writer w;
  w.metres();
  const std::string column = add_columns_and_a_long_one(w);
  // one entity for eight bars, and one for a stirrup along a composite curve, both of no role
  std::string disks;
  for (const auto& [x, y] : std::array<std::array<double, 2>, 8>{{{0.02, 0.02},
                                                                  {0.2, 0.02},
                                                                  {0.38, 0.02},
                                                                  {0.38, 0.15},
                                                                  {0.38, 0.28},
                                                                  {0.2, 0.28},
                                                                  {0.02, 0.28},
                                                                  {0.02, 0.15}}})
    disks += (disks.empty() ? "" : ",") +
             w.add("IFCSWEPTDISKSOLID(" +
                   w.add("IFCPOLYLINE((" + w.point(x, y, 0.05) + "," + w.point(x, y, 5.9) + "))") + ",0.0125,$,0.,1.)");
  const std::string place = w.placement("$", 11.8, -0.15, 0);
  const std::string bars =
      w.add("IFCREINFORCINGBAR('g',$,'LONGITUDINAL',$,$," + place + "," + w.shape("AdvancedSweptSolid", disks) +
            ",'1','B500B',0.025,4.9E-4,5.85,.NOTDEFINED.,$)");
  std::string segments;
  const double corners[5][2] = {{0, 0}, {0.4, 0}, {0.4, 0.3}, {0, 0.3}, {0, 0}};
  for (int i = 0; i < 4; ++i)
    segments +=
        (segments.empty() ? "" : ",") + w.add("IFCCOMPOSITECURVESEGMENT(.CONTINUOUS.,.T.," +
                                              w.add("IFCPOLYLINE((" + w.point(corners[i][0], corners[i][1], 1) + "," +
                                                    w.point(corners[i + 1][0], corners[i + 1][1], 1) + "))") +
                                              ")");
  const std::string tie = w.add(
      "IFCREINFORCINGBAR('g',$,'STIRRUP',$,$," + place + "," +
      w.shape("AdvancedSweptSolid",
              w.add("IFCSWEPTDISKSOLID(" + w.add("IFCCOMPOSITECURVE((" + segments + "),.F.)") + ",0.004,$,0.,4.)")) +
      ",'1','B500B',0.008,5.E-5,1.4,.USERDEFINED.,$)");
  const std::string cage = w.add("IFCELEMENTASSEMBLY('g',$,'CAGE',$,$,$,$,'1',$,.REINFORCEMENT_UNIT.)");
  w.add("IFCRELAGGREGATES('g',$,$,$," + cage + ",(" + bars + "," + tie + "))");
  w.add("IFCRELAGGREGATES('g',$,$,$," + column + ",(" + cage + "))");
  const Import made = import("IFC2X3", w);
  EXPECT_THAT(made.text, HasSubstr("bars = { count_y = 3, count_z = 3, diameter = \"25 mm\" }"));
  EXPECT_THAT(made.text, HasSubstr("cover = \"46 mm\""));
  EXPECT_THAT(made.text, HasSubstr("ties = { diameter = \"8 mm\", spacing = \"?\" }"));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("column_500x400_unknown: spacing of ties")));
}

/// Bars of the given diameter and role along lines, as parts of an element.
void add_bars(Writer& w, const std::string& host, const char* role, double diameter,
              const std::vector<std::vector<std::array<double, 3>>>& lines) {
  std::string bars;
  for (const auto& line : lines) {
    std::string points;
    for (const auto& p : line) points += (points.empty() ? "" : ",") + w.point(p[0], p[1], p[2]);
    const std::string disk = w.add("IFCSWEPTDISKSOLID(" + w.add("IFCPOLYLINE((" + points + "))") + "," +
                                   std::to_string(diameter / 2) + ",$,$,$)");
    bars += (bars.empty() ? "" : ",") + w.add("IFCREINFORCINGBAR('g',$,$,$,$," + w.placement("$", 0, 0, 0) + "," +
                                              w.shape("AdvancedSweptSolid", disk) + ",'1','B500B'," +
                                              std::to_string(diameter) + ",1.E-4,1.,." + role + ".,$)");
  }
  w.add("IFCRELAGGREGATES('g',$,$,$," + host + ",(" + bars + "))");
}

TEST(ImportIfcIdioms, ReadsCoverTiesAndLayersWhereTheBarsLie) {
  Writer w;
  w.metres();
  std::string column;  // 0.4 m x 0.5 m, 4 m high
  for (const double x : {0.0, 6.0})
    for (const double y : {0.0, 5.0})
      column = w.element("IFCCOLUMN", w.placement("$", x, y, 0),
                         w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.5), 4)));
  const std::string beam = w.element("IFCBEAM", w.placement("$", 3, 0, 3.4), w.shape("Brep", w.brep(6, 0.3, 0.6)));
  // the last column: two bars along x, three along y, and starters that end below the middle
  std::vector<std::vector<std::array<double, 3>>> bars, starters, ties;
  for (const double x : {5.85, 6.15})
    for (const double y : {4.8, 5.0, 5.2}) {
      bars.push_back({{x, y, 0.05}, {x, y, 3.95}});
      starters.push_back({{x, y + 0.025, -0.5}, {x, y + 0.025, 1.0}});
    }
  // 8 mm, axis 29 mm inside the faces: 25 mm clear; closer at the ends
  for (const double z : {0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.1})
    ties.push_back({{5.829, 4.779, z}, {6.171, 4.779, z}, {6.171, 5.221, z}, {5.829, 5.221, z}, {5.829, 4.779, z}});
  add_bars(w, column, "MAIN", 0.02, bars);
  add_bars(w, column, "MAIN", 0.02, starters);
  add_bars(w, column, "LIGATURE", 0.008, ties);
  // the beam, x from 0 to 6 m: three bars of 16 mm below, two of them bent up at their ends as hooks; above two of 12
  // mm all along and one of 20 mm over each support; one at the middle of the height
  add_bars(w, beam, "MAIN", 0.016,
           {{{0.1, -0.1, 3.9}, {0.1, -0.1, 3.45}, {5.9, -0.1, 3.45}, {5.9, -0.1, 3.9}},
            {{0.1, 0.0, 3.45}, {5.9, 0.0, 3.45}},
            {{0.1, 0.1, 3.9}, {0.1, 0.1, 3.45}, {5.9, 0.1, 3.45}, {5.9, 0.1, 3.9}}});
  add_bars(w, beam, "MAIN", 0.012,
           {{{0.1, -0.1, 3.95}, {5.9, -0.1, 3.95}},
            {{0.1, 0.1, 3.95}, {5.9, 0.1, 3.95}},
            {{0.1, 0.1, 3.7}, {5.9, 0.1, 3.7}}});
  add_bars(w, beam, "MAIN", 0.02, {{{0.1, 0.0, 3.95}, {1.5, 0.0, 3.95}}, {{4.5, 0.0, 3.95}, {5.9, 0.0, 3.95}}});
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("cover = \"25 mm\"\nties = { diameter = \"8 mm\", spacing = \"200 mm\" }\n"
                                   "bars = { count_y = 2, count_z = 3, diameter = \"20 mm\" }"));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("its ties lie 100 to 200 mm apart")));
  // the areas of 2 x 12 mm and 20 mm are those of 3 x 15.1 mm
  EXPECT_THAT(made.text, HasSubstr("cover = \"?\"\nties = { diameter = \"?\", spacing = \"?\" }\ntop = \"3 x 15.1 "
                                   "mm\"\nbottom = \"3 x 16 mm\""));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("its 3 bars above have several diameters")));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("1 bars at the middle of its height are left out")));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("cover, diameter of ties, spacing of ties")));
}

TEST(ImportIfcIdioms, TakesTwoLayersInOneWhereTheyFit) {
  const auto import_beam = [](double width) {
    Writer w;
    w.metres();
    add_square_columns(w);
    const std::string beam = w.element("IFCBEAM", w.placement("$", 3, 0, 2.5),
                                       w.shape("SweptSolid", w.extrusion(w.rectangle(6, width), 0.5)));
    std::vector<std::vector<std::array<double, 3>>> bars;
    for (const double z : {2.55, 2.6})
      for (const double y : {-0.07, -0.025, 0.025, 0.07}) bars.push_back({{0.05, y, z}, {5.95, y, z}});
    add_bars(w, beam, "MAIN", 0.025, bars);
    add_bars(w, beam, "MAIN", 0.016, {{{0.05, -0.07, 2.95}, {5.95, -0.07, 2.95}}});
    return import("IFC4", w);
  };
  const Import wide = import_beam(0.4), narrow = import_beam(0.19);
  EXPECT_THAT(wide.text, HasSubstr("top = \"1 x 16 mm\"\nbottom = \"8 x 25 mm\""));
  EXPECT_THAT(wide.report.guessed,
              Contains("section beam_400x500_unknown: 4 of its 8 bars below lie in further layers, up to 50 mm behind "
                       "the outermost one; all of them were taken in it"));
  // 8 x 25 mm = 200 mm
  EXPECT_THAT(narrow.text, HasSubstr("top = \"?\"\nbottom = \"?\""));
  EXPECT_THAT(narrow.report.missing,
              Contains("section beam_190x500_unknown: its 8 x 25.0 mm below, which do not fit into its width side by "
                       "side (4 of them in further layers)"));
}

TEST(ImportIfcIdioms, LeavesAGapWhereTiesAreOutsideTheirColumn) {
  Writer w;
  w.metres();
  const std::string column = add_columns_and_a_long_one(w);
  add_bars(w, column, "LIGATURE", 0.008, {{{11.7, -0.25, 1}, {12.3, -0.25, 1}, {12.3, 0.25, 1}, {11.7, 0.25, 1}}});
  EXPECT_THAT(import("IFC4", w).text, HasSubstr("cover = \"?\"\nties = { diameter = \"8 mm\", spacing = \"?\" }"));
}

TEST(ImportIfcIdioms, TakesDiameterAndRoleFromTheTypeOfMappedBars) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  const std::string origin = w.add("IFCAXIS2PLACEMENT3D(" + w.point(0, 0, 0) + ",$,$)");
  const std::string list = w.add("IFCCARTESIANPOINTLIST3D(((0.,0.,0.05),(0.,0.,2.9)),$)");
  const std::string disk =
      w.add("IFCSWEPTDISKSOLID(" + w.add("IFCINDEXEDPOLYCURVE(" + list + ",$,.F.)") + ",0.01,$,$,$)");
  const std::string map = w.add("IFCREPRESENTATIONMAP(" + origin + "," +
                                w.add("IFCSHAPEREPRESENTATION($,'Body','SolidModel',(" + disk + "))") + ")");
  std::string bars;
  for (const double x : {-0.15, 0.15})
    for (const double y : {-0.15, 0.15}) {
      const std::string item =
          w.add("IFCMAPPEDITEM(" + map + "," +
                w.add("IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$," + w.point(x, y, 0) + ",1.,$)") + ")");
      bars += (bars.empty() ? "" : ",") + w.add("IFCREINFORCINGBAR('g',$,$,$,$," + w.placement("$", 0, 0, 0) + "," +
                                                w.shape("MappedRepresentation", item) + ",$,$,$,$,$,$,$)");
    }
  const std::string type =
      w.add("IFCREINFORCINGBARTYPE('g',$,'20 mm',$,$,$,(" + map + "),$,$,.MAIN.,0.02,3.14E-4,2.85,.TEXTURED.,$,$)");
  w.add("IFCRELDEFINESBYTYPE('g',$,$,$,(" + bars + ")," + type + ")");
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("bars = { count_y = 2, count_z = 2, diameter = \"20 mm\" }"));
}

TEST(ImportIfcIdioms, FollowsArcsOfCompositeCurvesInTheFilesAngles) {
  Writer w;
  const std::string radian = w.add("IFCSIUNIT(*,.PLANEANGLEUNIT.,$,.RADIAN.)");
  const std::string degree = w.add("IFCMEASUREWITHUNIT(IFCPLANEANGLEMEASURE(0.0174532925199433)," + radian + ")");
  w.add("IFCUNITASSIGNMENT((" + w.add("IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)") + "," +
        w.add("IFCCONVERSIONBASEDUNIT($,.PLANEANGLEUNIT.,'DEGREE'," + degree + ")") + "))");
  // a column 0.6 m wide with a half round of 0.2 m at one end: 0.8 m x 0.4 m
  const auto body = [&] {
    const std::string straight = w.add("IFCPOLYLINE((" + w.point(0, 0.2, 0) + "," + w.point(-0.6, 0.2, 0) + "," +
                                       w.point(-0.6, -0.2, 0) + "," + w.point(0, -0.2, 0) + "))");
    const std::string circle = w.add("IFCCIRCLE(" + w.add("IFCAXIS2PLACEMENT2D(" + w.point(0, 0, 0) + ",$)") + ",0.2)");
    const std::string arc =
        w.add("IFCTRIMMEDCURVE(" + circle + ",(IFCPARAMETERVALUE(270.)),(IFCPARAMETERVALUE(90.)),.T.,.PARAMETER.)");
    const std::string outline =
        w.add("IFCCOMPOSITECURVE((" + w.add("IFCCOMPOSITECURVESEGMENT(.CONTINUOUS.,.T.," + straight + ")") + "," +
              w.add("IFCCOMPOSITECURVESEGMENT(.CONTINUOUS.,.T.," + arc + ")") + "),.F.)");
    return w.shape("SweptSolid", w.extrusion(w.add("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + outline + ")"), 3));
  };
  add_columns(w, "$", body);
  EXPECT_THAT(import("IFC2X3", w).text, HasSubstr("width = \"80 cm\"\nheight = \"40 cm\""));
}

TEST(ImportIfcIdioms, NamesTheProfileOfSteel) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] {
    return w.shape("SweptSolid",
                   w.extrusion(w.add("IFCISHAPEPROFILEDEF(.AREA.,'HEA200',$,0.2,0.19,0.0065,0.01,0.018)"), 3));
  });
  try {
    import("IFC2X3", w);
    FAIL() << "steel was taken for concrete";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics()[0].code, "E112");
    EXPECT_THAT(e.diagnostics()[0].help, HasSubstr("its profile is IFCISHAPEPROFILEDEF"));
  }
}

}  // namespace
}  // namespace topple::product
