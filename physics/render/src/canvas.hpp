// OpenGL without a screen.
#pragma once

#include "puppet.hpp"

#include <GL/osmesa.h>
#include <stdexcept>
#include <string>

namespace bf::physics {

/// CPU-only OpenGL context. MuJoCo draws into a buffer of its own, so that this one is as small as possible.
class Canvas {
  public:
    Canvas() : context_(OSMesaCreateContextExt(OSMESA_RGBA, 24, 8, 8, nullptr)) {
        if (!context_)
            throw std::runtime_error(
                "cannot create an off-screen OpenGL context; install Mesa's OSMesa library");
    }
    ~Canvas() { OSMesaDestroyContext(context_); }
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;

    /// Binds the context to the calling thread; false when OpenGL refuses.
    bool bind() { return OSMesaMakeCurrent(context_, pixels_, GL_UNSIGNED_BYTE, 8, 8); }
    void release() { OSMesaMakeCurrent(nullptr, nullptr, 0, 0, 0); }

  private:
    OSMesaContext context_;
    unsigned char pixels_[8 * 8 * 4] = {};
};

/// Keeps a canvas bound to this thread while OpenGL is called, so that renderers and threads do not meet.
class Drawing {
  public:
    explicit Drawing(Canvas& canvas) : canvas_(canvas) {
        if (!canvas_.bind()) throw std::runtime_error("cannot activate the off-screen OpenGL context");
    }
    ~Drawing() { canvas_.release(); }
    Drawing(const Drawing&) = delete;
    Drawing& operator=(const Drawing&) = delete;

  private:
    Canvas& canvas_;
};

/// MuJoCo's scene and OpenGL context of a model.
class Stage {
  public:
    Stage(const mjModel* model, int max_geoms, mjtFontScale letters = mjFONTSCALE_100) {
        const Drawing active(canvas);
        mjr_defaultContext(&context);
        mjr_makeContext(model, &context, letters);
        mjv_defaultScene(&scene);
        mjv_makeScene(model, &scene, max_geoms);
    }
    ~Stage() {
        mjv_freeScene(&scene);
        if (canvas.bind()) mjr_freeContext(&context);
        canvas.release();
    }
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

    /// Fills the scene with what the camera sees, as a function of nothing else: MuJoCo puts floors without
    /// end around the camera that the scene has before.
    void update(const mjModel* model, mjData* data, const mjvOption& visible, mjvCamera& camera) {
        mjv_updateCamera(model, data, &camera, &scene);
        mjv_updateScene(model, data, &visible, nullptr, &camera, mjCAT_ALL, &scene);
    }

    /// Draws the scene, with a text in the upper left corner, and reads what is asked for, rows from bottom
    /// to top. The canvas is bound.
    void draw(const mjrRect& whole, unsigned char* pixels, float* depths, const std::string& caption = {}) {
        mjr_setBuffer(mjFB_OFFSCREEN, &context);
        mjr_render(whole, &scene, &context);
        if (!caption.empty())
            mjr_overlay(mjFONT_NORMAL, mjGRID_TOPLEFT, whole, caption.c_str(), nullptr, &context);
        mjr_readPixels(pixels, depths, whole, &context);
    }

    /// Puts the lamps around a point, as shadows are drawn around lamps.
    void light_around(double x, double y) {
        for (int i = 0; i < scene.nlight; ++i) {
            if (scene.lights[i].headlight) continue;
            scene.lights[i].pos[0] += static_cast<float>(x);
            scene.lights[i].pos[1] += static_cast<float>(y);
        }
    }

    Canvas canvas;
    mjvScene scene;
    mjrContext context;
};

} // namespace bf::physics
