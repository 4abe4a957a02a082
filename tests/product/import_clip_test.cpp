// Bodies of IFC files that are cut along planes, joined or cut by other bodies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "base/error.h"
#include "ifc_writer.h"
#include "product/clip.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

std::string plane(Writer& w, const Vec3& p, const Vec3& normal) {
  return w.add("IFCPLANE(" +
               w.add("IFCAXIS2PLACEMENT3D(" + w.point(p.x, p.y, p.z) + "," +
                     w.add("IFCDIRECTION(" + Writer::tuple({normal.x, normal.y, normal.z}) + ")") + ",$)") +
               ")");
}
std::string half_space(Writer& w, const Vec3& p, const Vec3& normal, bool agreement) {
  return w.add("IFCHALFSPACESOLID(" + plane(w, p, normal) + (agreement ? ",.T.)" : ",.F.)"));
}
std::string combine(Writer& w, const std::string& how, const std::string& a, const std::string& b) {
  return w.add("IFCBOOLEANRESULT(." + how + ".," + a + "," + b + ")");
}
std::string column(Writer& w, double height) { return w.extrusion(w.rectangle(0.4, 0.3), height); }

IfcBuilding read(const Writer& w) { return read_ifc(ifc_file("IFC4", w.str()), "b.ifc"); }

/// The only element, of a building of that body.
IfcElement read_one(const std::function<std::string(Writer&)>& make_body) {
  Writer w;
  w.metres();
  w.element("IFCCOLUMN", w.placement("$", 0, 0, 0), w.shape("Clipping", make_body(w)));
  return read(w).elements.at(0);
}

TEST(ImportIfcClip, CutsColumnsOffAtHalfSpacesOfBothFlags) {
  for (const bool agreement : {true, false})
    for (const char* type : {"IFCBOOLEANRESULT", "IFCBOOLEANCLIPPINGRESULT"}) {
      const IfcElement e = read_one([&](Writer& w) {
        const std::string body = column(w, 4),
                          space = half_space(w, {0, 0, 3}, {0, 0, agreement ? -1. : 1.}, agreement);
        return w.add(std::string(type) + "(.DIFFERENCE.," + body + "," + space + ")");
      });
      EXPECT_TRUE(e.has_box) << e.why;
      EXPECT_TRUE(e.is_cut);
      EXPECT_FALSE(e.is_mesh);
      EXPECT_NEAR(e.low.z, 0, 1e-9) << agreement << type;
      EXPECT_NEAR(e.high.z, 3, 1e-9) << agreement << type;
    }
  // the other way round the upper piece is left, and an intersection leaves what a difference takes
  EXPECT_NEAR(read_one([](Writer& w) {
                return combine(w, "DIFFERENCE", column(w, 4), half_space(w, {0, 0, 3}, {0, 0, 1}, true));
              }).low.z,
              3, 1e-9);
  EXPECT_NEAR(read_one([](Writer& w) {
                return combine(w, "INTERSECTION", column(w, 4), half_space(w, {0, 0, 3}, {0, 0, 1}, true));
              }).high.z,
              3, 1e-9);
}

TEST(ImportIfcClip, CutsProfilesAlongAndSolidsAcross) {
  const IfcElement along = read_one([](Writer& w) {
    return combine(w, "DIFFERENCE", column(w, 4), half_space(w, {0.1, 0, 0}, {1, 0, 0}, false));
  });
  EXPECT_TRUE(along.has_box) << along.why;
  EXPECT_NEAR(along.high.x, 0.1, 1e-9);
  EXPECT_NEAR(along.low.x, -0.2, 1e-9);
  // an oblique cut, and a second one through what it left
  const IfcElement oblique = read_one([](Writer& w) {
    const std::string once = combine(w, "DIFFERENCE", column(w, 4), half_space(w, {0, 0, 3}, {0.1, 0, 1}, false));
    return combine(w, "DIFFERENCE", once, half_space(w, {0, 0, 1}, {0, 0, -1}, false));
  });
  EXPECT_TRUE(oblique.has_box) << oblique.why;
  EXPECT_NEAR(oblique.low.z, 1, 1e-9);
  EXPECT_NEAR(oblique.high.z, 3.02, 1e-9);
  // nothing is left
  try {
    (void)read_one([](Writer& w) {
      return combine(w, "DIFFERENCE", column(w, 4), half_space(w, {0, 0, -1}, {0, 0, 1}, false));
    });
    ADD_FAILURE() << "something was left";
  } catch (const InputError& e) { EXPECT_THAT(e.diagnostics()[0].help, HasSubstr("nothing is left of its body")); }
}

TEST(ImportIfcClip, VolumesOfCutPrismsAndMeshesAreRight) {
  // an L with a hole, cut obliquely and again: the volume by a plane's mean height over it
  const auto volume = [](const Shape& s) {
    double sum = 0;
    for (const Solid& solid : s.solids) sum += solid.volume();
    for (const Loop& f : s.faces) sum += dot(f.front(), calc_normal(f)) / 6;
    return sum;
  };
  Shape s;
  s.solids.push_back({{{{0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {2, 2, 0}, {2, 4, 0}, {0, 4, 0}},
                       {{0.5, 0.5, 0}, {1.5, 0.5, 0}, {1.5, 1.5, 0}, {0.5, 1.5, 0}}},
                      {0, 0, 10}});
  EXPECT_NEAR(volume(s), 110, 1e-9);
  const double a = 1 / std::sqrt(2.0);
  EXPECT_TRUE(clip(s, {{0, 0, 5}, {a, 0, a}}));  // z < 5 - x
  // 2x4 at x = 1, 2x2 at x = 3, less 1x1 at x = 1
  EXPECT_NEAR(volume(s), 8 * 4.0 + 4 * 2.0 - 1 * 4.0, 1e-9);
  EXPECT_TRUE(clip(s, {{0, 0, 0.5}, {0, 0, -1}}));
  EXPECT_NEAR(volume(s), 36 - 11 * 0.5, 1e-9);
  EXPECT_FALSE(clip(s, {{0, 0, 6}, {0, 0, 1}}));
}

TEST(ImportIfcClip, JoinsUnions) {
  const IfcElement e = read_one([](Writer& w) {
    const std::string upper = w.add("IFCEXTRUDEDAREASOLID(" + w.rectangle(0.4, 0.3) + "," +
                                    w.add("IFCAXIS2PLACEMENT3D(" + w.point(0, 0, 2) + ",$,$)") + "," +
                                    w.add("IFCDIRECTION((0.,0.,1.))") + ",2.)");
    return combine(w, "UNION", column(w, 2), upper);
  });
  EXPECT_TRUE(e.has_box) << e.why;
  EXPECT_NEAR(e.high.z, 4, 1e-9);
  EXPECT_FALSE(e.is_cut);
}

TEST(ImportIfcClip, TakesBoundedHalfSpacesThatLieAroundWhatTheyCut) {
  const auto bounded = [](Writer& w, double x_high) {
    const std::string outline =
        w.add("IFCPOLYLINE((" + w.add("IFCCARTESIANPOINT((-1.,-1.))") + "," +
              w.add("IFCCARTESIANPOINT(" + Writer::tuple({x_high, -1}) + ")") + "," +
              w.add("IFCCARTESIANPOINT(" + Writer::tuple({x_high, 1}) + ")") + "," +
              w.add("IFCCARTESIANPOINT((-1.,1.))") + "," + w.add("IFCCARTESIANPOINT((-1.,-1.))") + "))");
    return w.add("IFCPOLYGONALBOUNDEDHALFSPACE(" + plane(w, {0, 0, 3}, {0, 0, 1}) + ",.F.," +
                 w.add("IFCAXIS2PLACEMENT3D(" + w.point(0, 0, 0) + ",$,$)") + "," + outline + ")");
  };
  const IfcElement around = read_one([&](Writer& w) { return combine(w, "DIFFERENCE", column(w, 4), bounded(w, 1)); });
  EXPECT_NEAR(around.high.z, 3, 1e-9);
  EXPECT_FALSE(around.is_whole);
  const IfcElement partly =
      read_one([&](Writer& w) { return combine(w, "DIFFERENCE", column(w, 4), bounded(w, 0.05)); });
  EXPECT_NEAR(partly.high.z, 4, 1e-9);
  EXPECT_TRUE(partly.is_whole);
}

TEST(ImportIfcClip, SaysWhatIsTakenWhole) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] {
    return w.shape("CSG", combine(w, "DIFFERENCE", w.extrusion(w.rectangle(0.4, 0.4), 3), column(w, 1)));
  });
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.missing, Contains("8 elements are cut by bodies that are not read: they are taken whole"));
  EXPECT_THAT(made.text, HasSubstr("width = \"40 cm\"\nheight = \"40 cm\""));
}

TEST(ImportIfcClip, ChainsOfCutsAreLongAndCirclesEnd) {
  const IfcElement e = read_one([](Writer& w) {
    std::string body = column(w, 4);
    for (int i = 0; i < 40; ++i)
      body = combine(w, "DIFFERENCE", body, half_space(w, {0, 0, 3.9 - 0.01 * i}, {0, 0, 1}, false));
    return body;
  });
  EXPECT_NEAR(e.high.z, 3.51, 1e-9);
  for (const char* how : {"UNION", "DIFFERENCE"}) {
    Writer w;
    w.metres();
    w.element("IFCCOLUMN", w.placement("$", 0, 0, 0), w.shape("CSG", column(w, 3)));
    const std::string own = "#" + std::to_string(std::count(w.str().begin(), w.str().end(), '\n') + 1);
    EXPECT_EQ(combine(w, how, own, own), own);
    w.element("IFCCOLUMN", w.placement("$", 5, 0, 0), w.shape("CSG", own));
    EXPECT_FALSE(read(w).elements.at(1).has_box);
  }
}

TEST(ImportIfcClip, TellsOpeningsOfSlabsAndLowWalls) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  const std::string slab =
      w.element("IFCSLAB", w.placement("$", 3, 2.5, 2.8), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 5), 0.2)));
  w.element("IFCWALL", w.placement("$", 3, 0, 0), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 0.2), 1)));
  const Import closed = import("IFC4", w);
  EXPECT_THAT(closed.report.missing, Not(Contains(HasSubstr("openings of"))));
  EXPECT_THAT(closed.report.missing, Contains("1 x WALL: reaches over less than half of every storey"));
  w.add("IFCRELVOIDSELEMENT('g',$,$,$," + slab + ",#1)");
  EXPECT_THAT(import("IFC4", w).report.missing, Contains("openings of 1 slab: they are not read"));
}

TEST(ImportIfcClip, TellsOpeningsOfBeamsAndColumns) {
  Writer w;
  w.metres();
  const std::string columns = add_square_columns(w);
  const std::string beam =
      w.element("IFCBEAM", w.placement("$", 3, 0, 2.5), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 0.3), 0.5)));
  EXPECT_THAT(import("IFC4", w).report.missing, Not(Contains(HasSubstr("openings of"))));
  w.add("IFCRELVOIDSELEMENT('g',$,$,$," + beam + ",#1)");
  for (const std::string& column : {columns.substr(0, columns.find(',')), columns.substr(columns.rfind(',') + 1)})
    w.add("IFCRELVOIDSELEMENT('g',$,$,$," + column + ",#1)");
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.missing, Contains("openings of 1 beam: they are not read, the beam is taken whole"));
  EXPECT_THAT(made.report.missing, Contains("openings of 2 columns: they are not read, the columns are taken whole"));
}

TEST(ImportIfcClip, TakesOpeningsOfWallsBayByBay) {
  Writer w;
  w.metres();
  for (int s = 0; s < 2; ++s)
    for (const double x : {0.0, 6.0, 12.0})
      for (const double y : {0.0, 5.0})
        w.element("IFCCOLUMN", w.placement("$", x, y, 3 * s),
                  w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)));
  // over two bays and two storeys
  const std::string wall =
      w.element("IFCWALL", w.placement("$", 6, 0, 0), w.shape("SweptSolid", w.extrusion(w.rectangle(12, 0.24), 6)));
  const auto cut = [&](const std::string& wall_id, double x, double z, const std::string& profile, double height) {
    const std::string hole =
        w.element("IFCOPENINGELEMENT", w.placement("$", x, 0, z), w.shape("SweptSolid", w.extrusion(profile, height)));
    w.add("IFCRELVOIDSELEMENT('g',$,$,$," + wall_id + "," + hole + ")");
  };
  cut(wall, 2, 1, w.rectangle(1, 0.5), 1.2);      // a window
  cut(wall, 6, 0, w.rectangle(3, 0.24), 2.1);     // a gate on both sides of a column
  cut(wall, 10, 2, w.rectangle(0.8, 0.3), 2.5);   // through the floor between the storeys
  cut(wall, 9, 0.5, w.rectangle(0.5, 0.1), 0.5);  // a niche
  cut(wall, 2.2, 1.1, w.rectangle(1, 0.5), 0.5);  // within the window
  cut(wall, 4, 4, w.add("IFCCIRCLEPROFILEDEF(.AREA.,$,$,0.3)"), 1);
  // one above the other
  for (const double z : {0.0, 3.0}) {
    const std::string rear =
        w.element("IFCWALL", w.placement("$", 3, 5, z), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 0.24), 3)));
    const std::string hole = w.element("IFCOPENINGELEMENT", w.placement("$", 3, 5, z + 1),
                                       w.shape("SweptSolid", w.extrusion(w.rectangle(1, 0.24), 1)));
    w.add("IFCRELVOIDSELEMENT('g',$,$,$," + rear + "," + hole + ")");
  }
  const Import made = import("IFC4", w);
  const auto expect = [&](const std::string& at, const std::string& storeys, const std::string& list) {
    EXPECT_THAT(made.text, HasSubstr("storeys = [" + storeys + "]\nat = [" + at + "]\nopening = [\n" + list + "]\n"));
  };
  expect("\"A1B1\"", "0",
         "  { left = \"1.500 m\", sill = \"1.000 m\", width = \"1.000 m\", height = \"1.200 m\" },\n"
         "  { left = \"4.500 m\", sill = \"0.000 m\", width = \"1.299 m\", height = \"2.100 m\" },\n");
  expect("\"B1C1\"", "0",
         "  { left = \"0.201 m\", sill = \"0.000 m\", width = \"1.299 m\", height = \"2.100 m\" },\n"
         "  { left = \"3.600 m\", sill = \"2.000 m\", width = \"0.800 m\", height = \"0.999 m\" },\n");
  expect("\"B1C1\"", "1", "  { left = \"3.600 m\", sill = \"0.000 m\", width = \"0.800 m\", height = \"1.500 m\" },\n");
  expect("\"A2B2\"", "0, 1",
         "  { left = \"2.500 m\", sill = \"1.000 m\", width = \"1.000 m\", height = \"1.000 m\" },\n");
  EXPECT_THAT(made.report.taken, Contains("7 openings of walls"));
  EXPECT_THAT(made.report.missing, Contains("wall IFCWALL: 3 of its 6 openings are left out"));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("4 openings of walls reach into columns")));
}

TEST(ImportIfc, RefusesSchemasByTheirWholeNames) {
  Writer w;
  w.metres();
  w.element("IFCCOLUMN", w.placement("$", 0, 0, 0), w.shape("SweptSolid", column(w, 3)));
  for (const char* other : {"IFC4X3", "IFC4X3_ADD2", "IFC4FOO", "IFC2X2_FINAL", "ifc"}) {
    try {
      (void)read_ifc(ifc_file(other, w.str()), "b.ifc");
      ADD_FAILURE() << other;
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E112");
      EXPECT_EQ(e.diagnostics()[0].message, std::string("its schema is \"") + other + "\"");
    }
  }
  for (const char* known : {"IFC2X3", "IFC4", "IFC4_ADD2"})
    EXPECT_NO_THROW(read_ifc(ifc_file(known, w.str()), "b.ifc"));
}

}  // namespace
}  // namespace topple::product
