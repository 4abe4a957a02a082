#include "product/step_file.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace topple::product {
namespace {

TEST(StepFile, ReadsTextsOfEveryKind) {
  const auto read = [](const std::string& text) {
    const StepFile file = read_step("ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n#1=IFCTEXT('" +
                                        text + "');\nENDSEC;\nEND-ISO-10303-21;\n",
                                    "f.ifc");
    return file.entities.at(1).at(0).text;
  };
  EXPECT_EQ(read("Halle ''Nord''"), "Halle 'Nord'");
  EXPECT_EQ(read("St\\X2\\00FC\\X0\\tze"), "Stütze");
  EXPECT_EQ(read("St\\X\\FCtze"), "Stütze");
  EXPECT_EQ(read("St\\S\\|tze"), "Stütze");
  EXPECT_EQ(read("\\X4\\0001F3E0\\X0\\"), "\xF0\x9F\x8F\xA0");
  EXPECT_EQ(read("\\X2\\D83CDFE0\\X0\\"), "\xF0\x9F\x8F\xA0") << "two halves of UTF-16";
  EXPECT_EQ(read("\\X2\\D83C0041\\X0\\"),
            "\xEF\xBF\xBD"
            "A")
      << "half a character";
  EXPECT_EQ(read("St\xFCtze"), "Stütze") << "ISO 8859-1";
  EXPECT_EQ(read("Stütze"), "Stütze");
}

TEST(StepFile, RefusesIdsThatAreGivenTwice) {
  const std::string head = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n";
  try {
    (void)read_step(head + "#1=A();\n/* a\nremark */ #2=B();\n\n#1=C();\nENDSEC;\n", "f.ifc");
    FAIL() << "one of two was taken";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics()[0].code, "E111");
    EXPECT_EQ(e.diagnostics()[0].where.line, 10);
    EXPECT_EQ(e.diagnostics()[0].message, "#1 is given twice, first in line 6");
  }
}

}  // namespace
}  // namespace topple::product
