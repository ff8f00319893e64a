// The OpenGL backend if it is built and can start, with one context for all tests.
#pragma once

#include <splitcubes/occlusion/visibility.h>

#ifdef SPLITCUBES_WITH_RENDER
#include <splitcubes/occlusion_gl/opengl_backend.h>
#endif

namespace splitcubes::occlusion::testing {

#ifdef SPLITCUBES_WITH_RENDER

struct SharedContext {
    std::string why_not;
    std::shared_ptr<const gl::HeadlessContext> context;

    SharedContext() {
        if (auto made = gl::HeadlessContext::create(&why_not))
            context = std::make_shared<const gl::HeadlessContext>(std::move(*made));
    }
};

inline const SharedContext& shared_context() {
    static const SharedContext shared;
    return shared;
}
inline bool opengl_starts() {
    return shared_context().context != nullptr;
}
inline std::string no_opengl_because() {
    return "no OpenGL here: " + shared_context().why_not;
}
inline std::unique_ptr<OpenGlBackend> opengl_backend(const VisibilityOptions& options = {},
                                                     const OpenGlOptions& drawing = {}) {
    return std::make_unique<OpenGlBackend>(shared_context().context, options, drawing);
}

#else

inline bool opengl_starts() {
    return false;
}
inline std::string no_opengl_because() {
    return "built without OpenGL";
}
inline std::unique_ptr<VisibilityBackend> opengl_backend(const VisibilityOptions& options = {}) {
    return make_brute_force_backend(options);
}

#endif

}  // namespace splitcubes::occlusion::testing
