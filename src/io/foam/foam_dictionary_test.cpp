#include "io/foam/foam_dictionary.h"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cstdio>

#include "io/gzip.h"
#include "support/temporary_folder.h"

namespace maille {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

FoamFile parse(std::string_view text) {
  auto file = parse_foam_text(text, "test");
  EXPECT_TRUE(file) << file.error().message;
  return file ? std::move(*file) : FoamFile{};
}

std::string error_of(std::string_view text) {
  const auto file = parse_foam_text(text, "test");
  return file ? "no error" : file.error().message;
}

std::string text_of(const FoamFile& file, std::string_view keyword) {
  const auto* entry = file.dictionary.find(keyword);
  if (entry == nullptr) return "none";
  std::string text;
  for (const FoamToken& token : entry->tokens) text += (text.empty() ? "" : " ") + token.text;
  return text;
}

double number_of(const FoamFile& file, std::string_view keyword) {
  const auto* entry = file.dictionary.find(keyword);
  if (entry == nullptr || entry->tokens.size() != 1) return -12345;
  return entry->tokens[0].value;
}

TEST(FoamDictionary, ReadsEntriesListsAndDictionaries) {
  const FoamFile file = parse(
      "/* header */ FoamFile { version 2.0; class dictionary; }\n"
      "scale 1e-3; // millimetres\n"
      "list 2((0 1)(-2 .5));\n"
      "div(phi,U) Gauss linear;\n"
      "name \"a \\\"b\\\" // c\";");
  ASSERT_NE(file.dictionary.find("FoamFile"), nullptr);
  EXPECT_EQ(file.dictionary.find("FoamFile")->dictionary->find("class")->tokens[0].text, "dictionary");
  EXPECT_EQ(number_of(file, "scale"), 1e-3);
  EXPECT_EQ(text_of(file, "list"), "2 ( ( 0 1 ) ( -2 .5 ) )");
  EXPECT_EQ(text_of(file, "div(phi,U)"), "Gauss linear");
  EXPECT_EQ(text_of(file, "name"), "a \"b\" // c");
}

TEST(FoamDictionary, ReadsPackedFilesUnderEitherName) {
  const testing::TemporaryFolder folder;
  const auto file = file_sink(folder.path("d.gz"));
  ASSERT_TRUE(file);
  const auto packed = gzip_sink(**file);
  const std::string_view text = "scale 3;";
  ASSERT_TRUE(packed->write(std::as_bytes(std::span(text.data(), text.size()))));
  ASSERT_TRUE(packed->commit());
  ASSERT_TRUE((*file)->commit());
  for (const char* name : {"d", "d.gz"}) {
    const auto read = read_foam_file(folder.path(name));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(number_of(*read, "scale"), 3);
  }
}

TEST(FoamDictionary, TakesBlocksWrittenTightly) {
  EXPECT_EQ(text_of(parse("b (hex(0 1)fluid(2 3)simpleGrading(1 1));"), "b"),
            "( hex ( 0 1 ) fluid ( 2 3 ) simpleGrading ( 1 1 ) )");
}

TEST(FoamDictionary, PutsInVariables) {
  const FoamFile file =
      parse("n 10; list (1 2); all ($n ${n} $list); in { m 3; k $m; n $n; } o { p $:in.m; }");
  EXPECT_EQ(text_of(file, "all"), "( 10 10 ( 1 2 ) )");
  const auto& in = *file.dictionary.find("in")->dictionary;
  EXPECT_EQ(in.find("k")->tokens[0].text, "3");
  EXPECT_EQ(in.find("n")->tokens[0].text, "10");
  EXPECT_EQ(file.dictionary.find("o")->dictionary->find("p")->tokens[0].text, "3");
}

TEST(FoamDictionary, TheLastOfSeveralEntriesCounts) {
  EXPECT_EQ(text_of(parse("x 1; x 2; y $x; x 3;"), "x"), "3");
  EXPECT_EQ(text_of(parse("x 1; x 2; y $x; x 3;"), "y"), "2");
}

TEST(FoamDictionary, MergesDictionaries) {
  const FoamFile file = parse("a { x 1; in { y 2; } } b { $a; in { z 3; } } a { w 4; }");
  const auto& a = *file.dictionary.find("a")->dictionary;
  const auto& b = *file.dictionary.find("b")->dictionary;
  EXPECT_NE(a.find("w"), nullptr);
  EXPECT_NE(b.find("x"), nullptr);
  EXPECT_NE(b.find("in")->dictionary->find("z"), nullptr);
  EXPECT_EQ(a.find("in")->dictionary->find("z"), nullptr) << "what is merged is a copy";
}

TEST(FoamDictionary, Evaluates) {
  const FoamFile file = parse(
      "r 0.5; a 45; y #eval{ $r*sin(degToRad($a)) }; m #eval{ -1*$y }; c #calc \"2*(3 - ${r})/4 % 2\"; "
      "p #eval \"pow(2, 3) + min(1, $m) - -pi()/pi()\"; v (1 #eval{ 1+1 } 3);");
  EXPECT_NEAR(number_of(file, "y"), 0.35355339059327373, 1e-16);
  EXPECT_NEAR(number_of(file, "m"), -0.35355339059327373, 1e-16);
  EXPECT_EQ(number_of(file, "c"), 1.25);
  EXPECT_NEAR(number_of(file, "p"), 9 - 0.35355339059327373, 1e-15);
  EXPECT_EQ(file.dictionary.find("v")->tokens[2].value, 2);
}

TEST(FoamDictionary, NamesFileLineAndWhatIsWrong) {
  EXPECT_THAT(error_of("a 1;\nb (1 2;\nc 3;"), HasSubstr("test: line 2: entry 'b' does not end with ';'"));
  EXPECT_THAT(error_of("a 1;\nb (1 2));"), HasSubstr("test: line 2: entry 'b': a ')' without its '('"));
  EXPECT_THAT(error_of("a { b 1;"), HasSubstr("a '}' is missing"));
  EXPECT_THAT(error_of("}"), HasSubstr("without its '{'"));
  EXPECT_THAT(error_of("a $b;"), HasSubstr("'$b' is not known here"));
  EXPECT_THAT(error_of("a \"b;"), HasSubstr("a string is not closed"));
  EXPECT_THAT(error_of("\n/* a"), HasSubstr("test: line 2: a comment is not closed"));
  EXPECT_THAT(error_of("a #eval{ 1 + };"), HasSubstr("line 1: expression"));
  EXPECT_THAT(error_of("a #eval{ foo(1) };"), HasSubstr("'foo' is not understood"));
  EXPECT_THAT(error_of("b x; a #eval{ $b };"), HasSubstr("'$b' is no number"));
  EXPECT_THAT(error_of("5 x;"), HasSubstr("'5' where a keyword is expected"));
}

TEST(FoamDictionary, RefusesWhatNeedsOpenFoam) {
  const auto file = parse_foam_text("edges #codeStream { code #{ os << \"()\"; #}; };", "test");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::unsupported);
  EXPECT_THAT(file.error().message, AllOf(HasSubstr("line 1"), HasSubstr("#codeStream")));
}

TEST(FoamDictionary, IsBoundedWhateverVariablesSay) {
  std::string text = "a0 1;";
  for (int i = 0; i < 40; ++i) {
    const std::string old = " $a" + std::to_string(i);
    text += "a" + std::to_string(i + 1) + old + old + ";";
  }
  EXPECT_THAT(error_of(text), HasSubstr("too large"));
  text = "a0 { x 1; }";
  for (int i = 0; i < 40; ++i) {
    const std::string old = "{ $a" + std::to_string(i) + "; }";
    text += "a" + std::to_string(i + 1) + " { p " + old + " q " + old + " }";
  }
  EXPECT_THAT(error_of(text), HasSubstr("too large"));
  EXPECT_THAT(error_of(std::string(100000, '{')), HasSubstr("keyword"));
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "a{";
  EXPECT_THAT(error_of(deep), HasSubstr("too deeply"));
  EXPECT_THAT(error_of("a #eval{ " + std::string(100000, '(') + " };"), HasSubstr("too many parentheses"));
  EXPECT_THAT(error_of("a #eval{ " + std::string(100000, '-') + " };"), HasSubstr("too many parentheses"));
}

RC_GTEST_PROP(FoamDictionary, AnyTextGivesADictionaryOrAnError, ()) {
  static const std::vector<std::string> pieces{"a ",  "b",  "{",  "}",     "(",         ")",   ";",   "$a",
                                               "$b;", "\"", "/*", "*/",    "//",        "\n",  "1.5", "2(",
                                               "#{",  "#}", "#",  "#eval", "#include ", "${a", ".",   ":"};
  std::string text;
  for (const auto& piece : *rc::gen::container<std::vector<std::string>>(rc::gen::elementOf(pieces)))
    text += piece;
  const auto file = parse_foam_text(text, "/nowhere/test");
  RC_ASSERT(file || !file.error().message.empty());
}

TEST(FoamDictionary, IncludesFilesBesideIt) {
  const testing::TemporaryFolder folder;
  folder.write("sizes", "n 4;\n");
  folder.write("list", "1 $n\n");
  const auto file = read_foam_file(folder.write("dict",
                                                "#include \"sizes\"\nl (#include \"list\" 3);\n"
                                                "#includeIfPresent \"nothing\"\nm $n;"));
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(text_of(*file, "l"), "( 1 4 3 )");
  EXPECT_EQ(text_of(*file, "m"), "4");
}

TEST(FoamDictionary, NamesTheFileThatIncludes) {
  const testing::TemporaryFolder folder;
  const auto missing = read_foam_file(folder.write("dict", "\n#include \"nothing\"\n"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::cannot_read);
  EXPECT_THAT(missing.error().message, HasSubstr("dict: line 2"));
  folder.write("bad", "x 1;\n)");
  const auto bad = read_foam_file(folder.write("dict", "\n#include \"bad\"\n"));
  ASSERT_FALSE(bad);
  EXPECT_THAT(bad.error().message, HasSubstr("bad: line 2"));
  const auto circle = read_foam_file(folder.write("dict", "#include \"dict\"\n"));
  ASSERT_FALSE(circle);
  EXPECT_THAT(circle.error().message, HasSubstr("too deeply"));
}

}  // namespace
}  // namespace maille
