// Curves by points, shared points of meshes, parts of bodies that overlap or are not read, circles that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "ifc_writer.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

Import import_columns(const std::function<std::string(Writer&)>& make_item) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", make_item(w)); });
  return import("IFC4", w);
}
std::string closed(Writer& w, const std::string& curve) {
  return w.extrusion(w.add("IFCARBITRARYCLOSEDPROFILEDEF(.AREA.,$," + curve + ")"), 3);
}
std::string indexed(Writer& w, const std::string& points, const std::string& segments) {
  return w.add("IFCINDEXEDPOLYCURVE(" + w.add("IFCCARTESIANPOINTLIST2D((" + points + "))") + ",(" + segments +
               "),.F.)");
}

TEST(ImportIfcCurves, FollowTheirSegments) {
  // a rectangle whose points are not in order
  const Import line = import_columns([](Writer& w) {
    return closed(w, indexed(w, "(0.2,0.3),(-0.2,-0.3),(-0.2,0.3),(0.2,-0.3)", "IFCLINEINDEX((1,3,2,4,1))"));
  });
  EXPECT_THAT(line.text, HasSubstr("width = \"40 cm\"\nheight = \"60 cm\""));
  // half a circle each, wherever they begin
  for (const double begin : {0.0, 0.7853981633974483}) {
    std::string points;
    for (int i = 0; i < 4; ++i) {
      const double a = begin + i * 1.5707963267948966;
      points += (i > 0 ? "," : "") + Writer::tuple({0.3 * std::cos(a), 0.3 * std::sin(a)});
    }
    const Import round = import_columns(
        [&](Writer& w) { return closed(w, indexed(w, points, "IFCARCINDEX((1,2,3)),IFCARCINDEX((3,4,1))")); });
    EXPECT_THAT(round.text, HasSubstr("width = \"53.2 cm\"\nheight = \"53.2 cm\"")) << begin;
    EXPECT_THAT(round.report.guessed, Contains("round columns became square ones of the same area, 53 cm wide"));
    EXPECT_THAT(round.text, HasSubstr("rows = { A = \"0.000 m\", B = \"6.000 m\" }"));
  }
}

TEST(ImportIfcCurves, EndWhereAParameterIsNoAngle) {
  for (const char* far : {"1.E20", "-1.E300"}) {
    Writer w;
    w.metres();
    add_columns(w, "$", [&] {
      const std::string circle =
          w.add("IFCCIRCLE(" + w.add("IFCAXIS2PLACEMENT2D(" + w.point(0, 0, 0) + ",$)") + ",0.3)");
      return w.shape("SweptSolid", closed(w, w.add("IFCTRIMMEDCURVE(" + circle + ",(IFCPARAMETERVALUE(" + far +
                                                   ")),(IFCPARAMETERVALUE(1.)),.T.,.PARAMETER.)")));
    });
    EXPECT_THROW(import("IFC4", w), InputError) << far;
  }
}

TEST(ImportIfcMeshes, TakeTheirPointsByPlace) {
  // one list for all columns, each with its own places in it
  Writer w;
  w.metres();
  std::string points;
  for (const double x : {0.0, 6.0})
    for (const double y : {0.0, 5.0})
      for (const double z : {0.0, 3.0})
        for (const auto& [a, b] : {std::pair{-0.2, -0.3}, {0.2, -0.3}, {0.2, 0.3}, {-0.2, 0.3}})
          points += (points.empty() ? "" : ",") + Writer::tuple({x + a, y + b, z});
  const std::string list = w.add("IFCCARTESIANPOINTLIST3D((" + points + "))");
  for (int c = 0; c < 4; ++c) {
    std::string places;
    for (int i = 0; i < 8; ++i) places += (i > 0 ? "," : "") + std::to_string(8 * c + i + 1);
    const std::string faces =
        c % 2 == 0
            ? w.add(
                  "IFCTRIANGULATEDFACESET(" + list +
                  ",$,.T.,((1,3,2),(1,4,3),(5,6,7),(5,7,8),(1,2,6),(1,6,5),(2,3,7),(2,7,6),(3,4,8),(3,8,7),(4,1,5),(4,"
                  "5,8)),(" +
                  places + "))")
            : [&] {
                std::string all;
                for (const char* f : {"1,4,3,2", "5,6,7,8", "1,2,6,5", "2,3,7,6", "3,4,8,7", "4,1,5,8"})
                  all += (all.empty() ? "" : ",") + w.add(std::string("IFCINDEXEDPOLYGONALFACE((") + f + "))");
                return w.add("IFCPOLYGONALFACESET(" + list + ",.T.,(" + all + "),(" + places + "))");
              }();
    w.element("IFCCOLUMN", w.placement("$", 0, 0, 0), w.shape("Tessellation", faces));
  }
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.text, HasSubstr("rows = { A = \"0.000 m\", B = \"6.000 m\" }"));
  EXPECT_THAT(made.text, HasSubstr("frames = { 1 = \"0.000 m\", 2 = \"5.000 m\" }"));
  EXPECT_THAT(made.text, HasSubstr("width = \"40 cm\"\nheight = \"60 cm\""));
}

TEST(ImportIfcBodies, CountWhatOverlapsOnce) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  // a cross that fills 75 % of its box, and a square in two parts that overlap
  w.element("IFCCOLUMN", w.placement("$", 12, 0, 0),
            w.shape("SweptSolid", w.add("IFCBOOLEANRESULT(.UNION.," + w.extrusion(w.rectangle(0.8, 0.4), 3) + "," +
                                        w.extrusion(w.rectangle(0.4, 0.8), 3) + ")")));
  w.element("IFCCOLUMN", w.placement("$", 12, 5, 0),
            w.shape("SweptSolid", w.extrusion(w.rectangle(0.5, 0.5), 3) + "," + w.extrusion(w.rectangle(0.5, 0.3), 3)));
  const Import made = import("IFC4", w);
  EXPECT_THAT(made.report.missing, Contains("1 x COLUMN: its profile does not fill its box"));
  EXPECT_THAT(made.text, Not(HasSubstr("width = \"80 cm\"")));
  EXPECT_THAT(made.text, HasSubstr("width = \"50 cm\"\nheight = \"50 cm\""));
}

TEST(ImportIfcBodies, AreRoundAsAWholeOrNot) {
  const auto circle = [](Writer& w, double r) {
    return w.add("IFCCIRCLEPROFILEDEF(.AREA.,$,$," + std::to_string(r) + ")");
  };
  const Import inner = import_columns(
      [&](Writer& w) { return w.extrusion(w.rectangle(0.4, 0.4), 3) + "," + w.extrusion(circle(w, 0.1), 3); });
  EXPECT_THAT(inner.text, HasSubstr("width = \"40 cm\"\nheight = \"40 cm\""));
  EXPECT_THAT(inner.report.guessed, Not(Contains(HasSubstr("round columns"))));
  // a beam of 40 cm
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  const std::string axes = w.add("IFCAXIS2PLACEMENT3D(" + w.point(0, 0, 0) + "," + w.add("IFCDIRECTION((1.,0.,0.))") +
                                 "," + w.add("IFCDIRECTION((0.,1.,0.))") + ")");
  w.element("IFCBEAM", w.placement("$", 0.2, 0, 2.8),
            w.shape("SweptSolid", w.add("IFCEXTRUDEDAREASOLID(" + circle(w, 0.2) + "," + axes + "," +
                                        w.add("IFCDIRECTION((0.,0.,1.))") + ",5.6)")));
  const Import beam = import("IFC4", w);
  EXPECT_THAT(beam.text, HasSubstr("width = \"35.4 cm\"\nheight = \"35.4 cm\""));
  EXPECT_THAT(beam.report.guessed, Contains("round beams became square ones of the same area, 35 cm wide"));
}

TEST(ImportIfcBodies, OfWhichAPartIsNotReadAreLeftOut) {
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  w.element("IFCCOLUMN", w.placement("$", 12, 0, 0),
            w.shape("SweptSolid", w.extrusion(w.rectangle(0.3, 0.3), 3) + "," + w.add("IFCADVANCEDBREP($)")));
  EXPECT_THAT(import("IFC4", w).report.missing,
              Contains("1 x COLUMN: only a part of its body is read: its body is IFCADVANCEDBREP"));
}

TEST(ImportIfcMaterials, OfConstituentsAreThatOfTheLargestShare) {
  Writer w;
  w.metres();
  const std::string columns = add_square_columns(w);
  const auto constituent = [&](const char* name, const char* share) {
    return w.add(std::string("IFCMATERIALCONSTITUENT('c',$,") + w.add(std::string("IFCMATERIAL('") + name + "')") +
                 "," + share + ",$)");
  };
  const std::string parts = constituent("Plaster", "0.05") + "," + constituent("C30/37", "0.95");
  w.add("IFCRELASSOCIATESMATERIAL('g',$,$,$,(" + columns + ")," +
        w.add("IFCMATERIALCONSTITUENTSET('s',$,(" + parts + "))") + ")");
  EXPECT_THAT(import("IFC4", w).report.taken, Contains(HasSubstr("concrete C30_37: class C30/37")));
}

/// A wall of 35 cm and a slab of 30 cm over 6 m x 5 m, of a material of layers each.
Import import_layers(const std::vector<std::pair<std::string, double>>& wall_layers,
                     const std::vector<std::pair<std::string, double>>& slab_layers) {
  Writer w;
  w.metres();
  w.material("C20/25", add_square_columns(w));
  const auto associate = [&w](const std::string& element, const std::vector<std::pair<std::string, double>>& layers) {
    std::string list;
    for (const auto& [name, thickness] : layers)
      list += (list.empty() ? "" : ",") + w.add("IFCMATERIALLAYER(" + w.add("IFCMATERIAL('" + name + "')") + "," +
                                                std::to_string(thickness) + ",.F.)");
    const std::string set = w.add("IFCMATERIALLAYERSET((" + list + "),$)");
    w.add("IFCRELASSOCIATESMATERIAL('g',$,$,$,(" + element + ")," +
          w.add("IFCMATERIALLAYERSETUSAGE(" + set + ",.AXIS2.,.POSITIVE.,0.)") + ")");
  };
  associate(
      w.element("IFCWALL", w.placement("$", 3, 0, 0), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 0.35), 3))),
      wall_layers);
  associate(
      w.element("IFCSLAB", w.placement("$", 3, 2.5, 2.7), w.shape("SweptSolid", w.extrusion(w.rectangle(6, 5), 0.3))),
      slab_layers);
  return import("IFC4", w);
}

TEST(ImportIfcMaterials, OfLayersGiveTheThicknessOfThoseThatCarry) {
  const Import made = import_layers({{"Mineral wool", 0.2}, {"C30/37", 0.1}, {"C30/37", 0.05}},
                                    {{"Screed", 0.07}, {"EPS", 0.05}, {"Stahlbeton", 0.18}});
  EXPECT_THAT(made.text, HasSubstr("[wall.wall_150_C30_37]\nthickness = \"15 cm\"\nconcrete = \"C30_37\""));
  EXPECT_THAT(made.text, HasSubstr("[slab.slab_180_Stahlbeton]\nthickness = \"18 cm\""));
  EXPECT_THAT(made.report.guessed,
              Contains("1 wall of several layers, 350 mm in all: 150 mm of C30/37 carry and were taken, the other "
                       "layers are left out (their weight is a load)"));
  EXPECT_THAT(made.report.guessed,
              Contains(HasSubstr("1 slab of several layers, 300 mm in all: 180 mm of Stahlbeton")));
  // where no name says so, the thickest
  EXPECT_THAT(import_layers({{"a", 0.1}, {"b", 0.25}}, {{"a", 0.3}}).text, HasSubstr("[wall.wall_250_b]"));
}

TEST(ImportIfcMaterials, OfLayersThatAreNotThoseOfTheBodyLeaveItWhole) {
  const Import made = import_layers({{"Plaster", 0.02}, {"C30/37", 0.2}}, {{"Screed", 0.07}, {"C30/37", 0.3}});
  EXPECT_THAT(made.text, HasSubstr("[wall.wall_350_C30_37]"));
  EXPECT_THAT(made.text, HasSubstr("[slab.slab_300_C30_37]"));
  EXPECT_THAT(made.report.guessed,
              Contains("1 wall of several layers, which do not add up to the thickness of the body, 350 mm: all of it "
                       "was taken as C30/37"));
  EXPECT_THAT(made.report.guessed, Not(Contains(HasSubstr("1 slab of several layers"))));
}

}  // namespace
}  // namespace topple::product
