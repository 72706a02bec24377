#include <gtest/gtest.h>
#include <maille/xml.h>

namespace maille {
namespace {

TEST(Xml, EscapesWhatEndsAnAttributeAndShowsWhatXmlDoesNotHave) {
  EXPECT_EQ(xml_escaped("a & b <c> \"d\" 'e' \xc3\xa9"), "a &#38; b &#60;c&#62; &#34;d&#34; 'e' \xc3\xa9");
  EXPECT_EQ(xml_escaped("tab\tline\n"), "tab&#9;line&#10;");
  EXPECT_EQ(xml_escaped(std::string_view("\0\x1f", 2)), "\xe2\x90\x80\xe2\x90\x9f");
  EXPECT_TRUE(is_xml_text("tab\t\xc3\xa9"));
  EXPECT_FALSE(is_xml_text("\x01"));
}

}  // namespace
}  // namespace maille
