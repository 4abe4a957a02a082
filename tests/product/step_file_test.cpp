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

TEST(StepFile, ReadsAllSectionsOfData) {
  const std::string head =
      "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA('a',('IFC4'));\n#1=A();\nENDSEC;\n";
  const StepFile file =
      read_step(head + "/* second */\nDATA('b',('IFC4'));\n#2=B(#1);\nENDSEC ;\nEND-ISO-10303-21;\n", "f");
  ASSERT_EQ(file.entities.size(), 2U);
  EXPECT_EQ(file.entities.at(2).line, 10);
  EXPECT_EQ(read_step(head, "f").entities.size(), 1U);
  EXPECT_THROW((void)read_step(head + "DATA;\n#2=B(", "f"), InputError);
}

TEST(StepFile, RefusesIdsThatAreGivenTwice) {
  const std::string head = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n";
  try {
    (void)read_step(head + "#1=A();\n/* a\nremark */ #2=B();\n\n#1=C();\nENDSEC;\n", "f.ifc");
    FAIL() << "one of two was taken";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics()[0].code, "E111");
    EXPECT_EQ(e.diagnostics()[0].where.line, 10);
    EXPECT_EQ(e.diagnostics()[0].where.column, 1);
    EXPECT_EQ(e.diagnostics()[0].message, "#1 is given twice, first in line 6");
  }
}

TEST(StepFile, ColumnsCountCharactersFromOne) {
  const std::string head = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n";
  const auto column = [&](const std::string& text) {
    try {
      (void)read_step(text, "f.ifc");
    } catch (const InputError& e) { return e.diagnostics()[0].where.column; }
    return 0;
  };
  EXPECT_EQ(column(head + "#1=A('Stütze',?);\nENDSEC;\n"), 15);
  EXPECT_EQ(column(head + "#1=A(1); #1=A(2);\nENDSEC;\n"), 10);
  EXPECT_EQ(column("hello"), 1);
  const StepFile file = read_step(head + "#1=A(1); /* ü */ #2=A(2);\n  #3=A(3);\nENDSEC;\n", "f.ifc");
  EXPECT_EQ(file.entities.at(2).column, 18);
  EXPECT_EQ(file.entities.at(3).column, 3);
}

TEST(StepFile, FindsSchemaAndDataWhateverHeadersHold) {
  const std::string schema = "FILE_SCHEMA(('IFC4'));\n", data = "DATA;\n#1=A(2);\nENDSEC;\n";
  for (const std::string& text :
       {"\xEF\xBB\xBFISO-10303-21;\nHEADER;\n" + schema + "ENDSEC;\n" + data,
        "ISO-10303-21;\nHEADER;\nFILE_NAME('it''s; DATA;','',(''),(''),'','','');\n" + schema + "ENDSEC;\n" + data,
        "ISO-10303-21;\nHEADER;\n/* FILE_SCHEMA(('IFC2X3')); DATA; */\n" + schema + "ENDSEC;\n" + data,
        "ISO-10303-21 ;\nHEADER ;\nFILE_DESCRIPTION(('FILE_SCHEMA'),'2;1');\nfile_schema ( ( 'IFC4' ) ) ;\nENDSEC ;\n" +
            data,
        "ISO-10303-21;\nHEADER;\n" + schema + "ENDSEC;\nDATA /* one */ ;\n#1=A(2);\nENDSEC;\n",
        "ISO-10303-21;\nHEADER;\n" + schema +
            "ENDSEC;\nANCHOR;\n<a>=#1;\nENDSEC;\nDATA('x',('IFC4'));\n#1=A(2);\nENDSEC;\n"}) {
    const StepFile file = read_step(text, "f.ifc");
    EXPECT_EQ(file.schema, "IFC4") << text;
    ASSERT_EQ(file.entities.size(), 1u) << text;
    EXPECT_EQ(file.entities.at(1).at(0).number, 2) << text;
  }
  for (const char* broken : {"ISO-10303-21;\nHEADER;\n", "ISO-10303-21;\nHEADER;\nFILE_NAME('", "ISO-10303-21",
                             "ISO-10303-21;\nFILE_SCHEMA", "ISO-10303-21;\nDATA", "ISO-10303-21;\nX('a''"})
    EXPECT_THROW((void)read_step(broken, "f.ifc"), InputError) << broken;
}

}  // namespace
}  // namespace topple::product
