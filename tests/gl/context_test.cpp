// A context without a window: it starts or says why not, two can coexist, and programs and targets work in
// it.
#include <gtest/gtest.h>
#include <splitcubes/core/error.h>
#include <splitcubes/gl/context.h>
#include <splitcubes/gl/objects.h>
#include <splitcubes/gl/program.h>
#include <splitcubes/gl/shader_source.h>

#include <array>
#include <string>

namespace {

using namespace splitcubes;

constexpr const char* screen_vertex = R"(#version 330 core
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); })";
constexpr const char* color_fragment = R"(#version 330 core
uniform vec4 wanted;
out vec4 color;
void main() { color = wanted; })";

class GlTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string why_not;
        context = gl::HeadlessContext::create(&why_not);
        if (!context) {
            EXPECT_FALSE(why_not.empty());
            GTEST_SKIP() << "no OpenGL here: " << why_not;
        }
    }
    std::optional<gl::HeadlessContext> context;
};

std::array<unsigned char, 4> drawn_color(const std::array<float, 4>& wanted) {
    const gl::Program program("test", screen_vertex, color_fragment);
    const gl::Texture texture(GL_RGBA8, 8, 8, GL_NEAREST);
    gl::Framebuffer framebuffer;
    framebuffer.attach(GL_COLOR_ATTACHMENT0, texture);
    framebuffer.check("test");
    const gl::VertexArray none;
    none.bind();
    glViewport(0, 0, 8, 8);
    program.use();
    program.set("wanted", wanted);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    std::array<unsigned char, 4> pixel{};
    glReadPixels(5, 3, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
    gl::check_errors("test");
    return pixel;
}

TEST_F(GlTest, NamesWhatItFound) {
    EXPECT_FALSE(context->renderer().empty());
    EXPECT_FALSE(context->vendor().empty());
    EXPECT_FALSE(context->platform().empty());
    EXPECT_GE(10 * context->major_version() + context->minor_version(), 33);
    const std::string major =
        std::to_string(context->major_version()) + "." + std::to_string(context->minor_version());
    EXPECT_NE(context->version().find(major), std::string::npos);
}

TEST(OpenglSummary, IsOneLineOnAnyMachine) {
    const std::string summary = gl::opengl_summary();
    EXPECT_FALSE(summary.empty());
    EXPECT_EQ(summary.find('\n'), std::string::npos);
    const bool works = gl::HeadlessContext::create().has_value();
    EXPECT_EQ(summary.rfind("none", 0) == 0, !works);
}

TEST_F(GlTest, ProgramDrawsTheGivenColor) {
    EXPECT_EQ(drawn_color({1.0F, 0.2F, 0.0F, 1.0F}), (std::array<unsigned char, 4>{255, 51, 0, 255}));
    EXPECT_EQ(drawn_color({0.0F, 0.0F, 1.0F, 0.0F}), (std::array<unsigned char, 4>{0, 0, 255, 0}));
}

TEST_F(GlTest, ContextsDoNotDisturbEachOther) {
    {
        const auto second = gl::HeadlessContext::create();
        ASSERT_TRUE(second.has_value());
        EXPECT_EQ(drawn_color({0.0F, 1.0F, 0.0F, 1.0F})[1], 255);
        context->make_current();
        EXPECT_EQ(drawn_color({1.0F, 0.0F, 0.0F, 1.0F})[0], 255);
        second->make_current();
    }
    // The other context is gone, this one still draws, also after a move.
    const gl::HeadlessContext moved = std::move(*context);
    moved.make_current();
    EXPECT_EQ(drawn_color({0.0F, 0.0F, 1.0F, 1.0F})[2], 255);
}

TEST_F(GlTest, BrokenShadersAreJobErrorsWithTheLog) {
    try {
        const gl::Program program("broken", screen_vertex,
                                  "#version 330 core\nvoid main() { no_such_name = 1; }");
        FAIL() << "compiled";
    } catch (const JobError& error) {
        const std::string what = error.what();
        EXPECT_NE(what.find("broken (fragment)"), std::string::npos) << what;
        EXPECT_NE(what.find("no_such_name"), std::string::npos) << what;
        EXPECT_EQ(what.find('\n'), std::string::npos);
    }
    // Both shaders compile, but their interface does not match.
    EXPECT_THROW(gl::Program("unlinked",
                             "#version 330 core\nout vec2 passed; void main() { passed = vec2(gl_VertexID); "
                             "gl_Position = vec4(0.0); }",
                             "#version 330 core\nin vec3 passed; out vec4 color; void main() { color = "
                             "vec4(passed, 1.0); }"),
                 JobError);
    EXPECT_THROW(gl::Program::from_files("no-such-file.vert", "mesh.frag"), JobError);
}

TEST_F(GlTest, IncompleteFramebufferIsAJobError) {
    const gl::Framebuffer empty;
    EXPECT_THROW(empty.check("nothing"), JobError);
}

TEST(ShaderSource, IncludesAreExpanded) {
    const std::string_view text = gl::shader_source("mesh.frag");
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(text.rfind("#version 330 core", 0), 0U);
    EXPECT_EQ(text.find("#include"), std::string_view::npos);
    EXPECT_NE(text.find("visibility_at("), std::string_view::npos);
    EXPECT_TRUE(gl::shader_source("no-such-file").empty());
}

}  // namespace
