// Elements that do not lie along a grid, do not fill their box, share a place, are scaled or have none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace topple::product
