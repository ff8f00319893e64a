#include <splitcubes/gl/context.h>

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <splitcubes/core/error.h>

#include <array>
#include <cstring>
#include <exception>
#include <sstream>
#include <utility>
#include <vector>

namespace splitcubes::gl {

struct HeadlessContext::Impl {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    std::string platform;
    std::string renderer;
    std::string vendor;
    std::string version;
    int major_version = 0;
    int minor_version = 0;

    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        if (context == EGL_NO_CONTEXT) return;
        if (eglGetCurrentContext() == context) {
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        }
        // The display is shared by all contexts of the process, so it is not terminated here.
        eglDestroyContext(display, context);
    }
};

namespace {

std::string hex(unsigned value) {
    std::ostringstream text;
    text << "0x" << std::hex << value;
    return text.str();
}

bool has_word(const char* words, const char* word) {
    if (words == nullptr) return false;
    std::istringstream stream(words);
    std::string one;
    while (stream >> one) {
        if (one == word) return true;
    }
    return false;
}

std::string driver_text(GLenum name) {
    const GLubyte* text = glGetString(name);
    return text == nullptr ? std::string("unknown") : printable(reinterpret_cast<const char*>(text), 200);
}

struct Candidate {
    EGLDisplay display;
    std::string platform;
};

std::vector<Candidate> candidates(std::string& why_not) {
    std::vector<Candidate> found;
    if (!epoxy_has_egl()) {
        why_not = "the library libEGL.so.1 is missing";
        return found;
    }
    const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!has_word(extensions, "EGL_EXT_platform_base")) {
        why_not = "EGL has no EGL_EXT_platform_base";
        return found;
    }
    const auto get_display =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    const auto query_devices =
        reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    if (get_display == nullptr) {
        why_not = "EGL has no eglGetPlatformDisplayEXT";
        return found;
    }
    if (query_devices != nullptr && has_word(extensions, "EGL_EXT_platform_device")) {
        std::array<EGLDeviceEXT, 16> devices{};
        EGLint count = 0;
        if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE) {
            for (EGLint i = 0; i < count; ++i) {
                found.push_back(
                    {get_display(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr),
                     "EGL device " + std::to_string(i)});
            }
        }
    }
    if (has_word(extensions, "EGL_MESA_platform_surfaceless")) {
        found.push_back(
            {get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr), "EGL surfaceless"});
    }
    if (found.empty()) why_not = "EGL offers neither devices nor the surfaceless platform";
    return found;
}

EGLContext core_context(EGLDisplay display, EGLConfig config) {
    for (const auto& [major, minor] : {std::pair{4, 5}, std::pair{3, 3}}) {
        const std::array<EGLint, 7> attributes = {EGL_CONTEXT_MAJOR_VERSION,
                                                  major,
                                                  EGL_CONTEXT_MINOR_VERSION,
                                                  minor,
                                                  EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                                  EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                                  EGL_NONE};
        const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, attributes.data());
        if (context != EGL_NO_CONTEXT) return context;
    }
    return EGL_NO_CONTEXT;
}

/// Returns an empty string if the context is made and current, otherwise the failed step.
std::string start(const Candidate& candidate, EGLContext& context) {
    const auto failed = [](const char* step) {
        return std::string(step) + " " + hex(static_cast<unsigned>(eglGetError()));
    };
    if (candidate.display == EGL_NO_DISPLAY) return failed("no display");
    if (eglInitialize(candidate.display, nullptr, nullptr) != EGL_TRUE) return failed("eglInitialize");
    if (!has_word(eglQueryString(candidate.display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context")) {
        return "no EGL_KHR_surfaceless_context";
    }
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return failed("eglBindAPI");
    // Only framebuffer objects are drawn to, so any config that supports OpenGL is suitable.
    const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(candidate.display, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1) {
        return failed("eglChooseConfig");
    }
    context = core_context(candidate.display, config);
    if (context == EGL_NO_CONTEXT) return failed("eglCreateContext 3.3 core");
    if (eglMakeCurrent(candidate.display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
        const std::string why = failed("eglMakeCurrent");
        eglDestroyContext(candidate.display, context);
        context = EGL_NO_CONTEXT;
        return why;
    }
    return {};
}

}  // namespace

HeadlessContext::HeadlessContext(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HeadlessContext::~HeadlessContext() = default;
HeadlessContext::HeadlessContext(HeadlessContext&&) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&&) noexcept = default;

std::optional<HeadlessContext> HeadlessContext::create(std::string* why_not) {
    std::string reasons;
    for (const Candidate& candidate : candidates(reasons)) {
        auto impl = std::make_unique<Impl>();
        const std::string problem = start(candidate, impl->context);
        if (!problem.empty()) {
            reasons += (reasons.empty() ? "" : ", ") + candidate.platform + ": " + problem;
            continue;
        }
        impl->display = candidate.display;
        impl->platform = candidate.platform;
        impl->renderer = driver_text(GL_RENDERER);
        impl->vendor = driver_text(GL_VENDOR);
        impl->version = driver_text(GL_VERSION);
        glGetIntegerv(GL_MAJOR_VERSION, &impl->major_version);
        glGetIntegerv(GL_MINOR_VERSION, &impl->minor_version);
        return HeadlessContext(std::move(impl));
    }
    if (why_not != nullptr) *why_not = reasons;
    return std::nullopt;
}

void HeadlessContext::make_current() const {
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE ||
        eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl_->context) != EGL_TRUE) {
        throw JobError("OpenGL: the context cannot be made current (EGL error " +
                       hex(static_cast<unsigned>(eglGetError())) + ")");
    }
}

const std::string& HeadlessContext::renderer() const {
    return impl_->renderer;
}
const std::string& HeadlessContext::vendor() const {
    return impl_->vendor;
}
const std::string& HeadlessContext::version() const {
    return impl_->version;
}
const std::string& HeadlessContext::platform() const {
    return impl_->platform;
}
int HeadlessContext::major_version() const {
    return impl_->major_version;
}
int HeadlessContext::minor_version() const {
    return impl_->minor_version;
}

std::string opengl_summary() noexcept {
    try {
        std::string why_not;
        const auto context = HeadlessContext::create(&why_not);
        if (!context) return "none (" + why_not + ")";
        return context->renderer() + ", OpenGL " + context->version() + ", " + context->platform();
    } catch (const std::exception&) {
        // Reached only when out of memory; this string needs no allocation.
        return "none";
    }
}

}  // namespace splitcubes::gl
