// Dear ImGui, with its backends for GLFW and OpenGL, behind a C header: nothing of it leaves this file.
#include "renderer/gui/gui.h"

#include <imgui.h>

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace
{

constexpr float FONT_PX = 14.0F, LABEL_PART = 0.36F;

float scale = 1.0F;

const ImVec4 tones[] = { { 0.86F, 0.88F, 0.90F, 1.0F },
                         { 0.52F, 0.55F, 0.59F, 1.0F },
                         { 0.96F, 0.74F, 0.36F, 1.0F },
                         { 0.56F, 0.82F, 0.62F, 1.0F } };

// Latin, Greek, and the signs of formulas.
const ImWchar glyphs[] = { 0x20,   0xff,   0x370,  0x3ff,  0x2010, 0x2044, 0x2070, 0x209f, 0x2100,
                           0x214f, 0x2190, 0x21ff, 0x2200, 0x22ff, 0x25a0, 0x25ff, 0 };

ImVec4 colour(int rgb, float alpha = 1.0F)
{
    return { static_cast<float>(rgb >> 16 & 255) / 255.0F, static_cast<float>(rgb >> 8 & 255) / 255.0F,
             static_cast<float>(rgb & 255) / 255.0F, alpha };
}

ImU32 packed(int rgb, float alpha = 1.0F)
{
    return ImGui::ColorConvertFloat4ToU32(colour(rgb, alpha));
}

void set_colours(ImVec4 *colours)
{
    colours[ImGuiCol_Text] = tones[GUI_PLAIN];
    colours[ImGuiCol_TextDisabled] = tones[GUI_DIM];
    colours[ImGuiCol_WindowBg] = colour(0x1b1e23);
    colours[ImGuiCol_PopupBg] = colour(0x23272e, 0.98F);
    colours[ImGuiCol_Border] = colour(0x3a404a, 0.6F);
    colours[ImGuiCol_FrameBg] = colour(0x2a2f37);
    colours[ImGuiCol_FrameBgHovered] = colour(0x343b46);
    colours[ImGuiCol_FrameBgActive] = colour(0x3c4552);
    colours[ImGuiCol_SliderGrab] = colour(0x6f93b8, 0.7F);
    colours[ImGuiCol_SliderGrabActive] = colour(0x93b7dc);
    colours[ImGuiCol_CheckMark] = colour(0x93b7dc);
    colours[ImGuiCol_Button] = colour(0x32465c);
    colours[ImGuiCol_ButtonHovered] = colour(0x3d5875);
    colours[ImGuiCol_ButtonActive] = colour(0x486b90);
    colours[ImGuiCol_Header] = colour(0x2b323b);
    colours[ImGuiCol_HeaderHovered] = colour(0x36414e);
    colours[ImGuiCol_HeaderActive] = colour(0x40505f);
    colours[ImGuiCol_ScrollbarBg] = colour(0x1b1e23);
    colours[ImGuiCol_ScrollbarGrab] = colour(0x3a424d);
    colours[ImGuiCol_PlotLines] = colour(0x8fb4d9);
    colours[ImGuiCol_TableRowBgAlt] = colour(0xffffff, 0.03F);
}

void set_style()
{
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    set_colours(style.Colors);
    style.WindowRounding = 0.0F;
    style.WindowBorderSize = 0.0F;
    style.FrameRounding = 3.0F;
    style.GrabRounding = 3.0F;
    style.PopupRounding = 3.0F;
    style.WindowPadding = { 10.0F, 8.0F };
    style.FramePadding = { 6.0F, 3.0F };
    style.ItemSpacing = { 6.0F, 5.0F };
    style.ItemInnerSpacing = { 5.0F, 4.0F };
    style.CellPadding = { 4.0F, 2.0F };
    style.ScrollbarSize = 11.0F;
    style.ScaleAllSizes(scale);
    ImGui::GetStyle() = style;
}

// The label to the left; what follows takes the rest of the line.
void put_label(const char *label)
{
    const float start = ImGui::GetCursorPosX(), width = ImGui::GetContentRegionAvail().x;
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label);
    ImGui::SameLine(start + LABEL_PART * width);
    ImGui::SetNextItemWidth(-1.0F);
}

bool slider(const char *name, const gui_range &range, double *value)
{
    const int flags = ImGuiSliderFlags_AlwaysClamp | (range.is_log ? ImGuiSliderFlags_Logarithmic : 0) |
                      ImGuiSliderFlags_NoRoundToFormat;
    return ImGui::SliderScalar(name, ImGuiDataType_Double, value, &range.min, &range.max, range.format,
                               flags);
}

ImVec2 point(double x, double y)
{
    return { static_cast<float>(x), static_cast<float>(y) };
}

} // namespace

/* ---- frames ------------------------------------------------------------------------------------- */

bool gui_create(void *window, const char *font_path, dipole_status *status)
{
    auto *const handle = static_cast<GLFWwindow *>(window);
    float scale_y = 1.0F;
    glfwGetWindowContentScale(handle, &scale, &scale_y);
    scale = std::clamp(scale, 1.0F, 4.0F);
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr; // nothing is kept beside the pictures
    io.LogFilename = nullptr;
    if (access(font_path, R_OK) == 0)
        io.Fonts->AddFontFromFileTTF(font_path, FONT_PX * scale, nullptr, glyphs);
    set_style();
    if (!ImGui_ImplGlfw_InitForOpenGL(handle, true)) {
        ImGui::DestroyContext();
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, nullptr,
                           "the panel could not be tied to the window");
    }
    if (!ImGui_ImplOpenGL3_Init("#version 450 core")) {
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
        return dipole_fail(status, DIPOLE_NOT_SUPPORTED, nullptr, "the panel could not be tied to OpenGL");
    }
    return true;
}

void gui_destroy()
{
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

void gui_begin()
{
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
}

void gui_end()
{
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

double gui_scale()
{
    return static_cast<double>(scale);
}

bool gui_is_typing()
{
    return ImGui::GetIO().WantTextInput;
}

bool gui_has_list()
{
    return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup);
}

/* ---- panel -------------------------------------------------------------------------------------- */

void gui_panel_begin(double width, double height)
{
    ImGui::SetNextWindowPos({ 0.0F, 0.0F });
    ImGui::SetNextWindowSize(point(width, height));
    ImGui::Begin("panel", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_AlwaysVerticalScrollbar);
}

void gui_panel_end()
{
    ImGui::End();
}

bool gui_section(const char *title, bool is_open_at_first)
{
    return ImGui::CollapsingHeader(title, is_open_at_first ? ImGuiTreeNodeFlags_DefaultOpen : 0);
}

void gui_text(gui_tone tone, const char *text)
{
    ImGui::PushStyleColor(ImGuiCol_Text, tones[tone]);
    ImGui::PushTextWrapPos(0.0F);
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::PopStyleColor();
}

void gui_value(const char *label, gui_tone tone, const char *value)
{
    put_label(label);
    ImGui::PushStyleColor(ImGuiCol_Text, tones[tone]);
    const float room = ImGui::GetContentRegionAvail().x;
    ImGui::TextUnformatted(value);
    ImGui::PopStyleColor();
    if (ImGui::CalcTextSize(value).x > room)
        gui_tip(value);
}

bool gui_slider(const char *label, const gui_range *range, double *value)
{
    ImGui::PushID(label);
    put_label(label);
    const bool is_changed = slider("##slider", *range, value);
    ImGui::PopID();
    return is_changed;
}

bool gui_choice(const char *label, const char *const *names, size_t count, size_t *index)
{
    bool is_changed = false;
    ImGui::PushID(label);
    put_label(label);
    const char *const shown = *index < count ? names[*index] : "";
    if (ImGui::BeginCombo("##choice", shown, ImGuiComboFlags_HeightLarge)) {
        for (size_t i = 0; i < count; i++) {
            ImGui::PushID(static_cast<int>(i));
            if (ImGui::Selectable(names[i], i == *index)) {
                is_changed = i != *index;
                *index = i;
            }
            if (i == *index)
                ImGui::SetItemDefaultFocus();
            ImGui::PopID();
        }
        ImGui::EndCombo();
    } else if (ImGui::CalcTextSize(shown).x > ImGui::GetItemRectSize().x - ImGui::GetFrameHeight()) {
        gui_tip(shown);
    }
    ImGui::PopID();
    return is_changed;
}

bool gui_check(const char *label, bool *is_set)
{
    return ImGui::Checkbox(label, is_set);
}

bool gui_field(const char *label, char *text, size_t size)
{
    ImGui::PushID(label);
    put_label(label);
    const bool is_changed = ImGui::InputText("##field", text, size);
    ImGui::PopID();
    return is_changed;
}

int gui_sliders(const char *label, bool is_colour, const gui_range *range, double values[3])
{
    static const int hues[3] = { 0xb8605c, 0x62a06a, 0x5f86c4 };
    int changed = -1;
    ImGui::PushID(label);
    ImGui::TextUnformatted(label);
    const float gap = ImGui::GetStyle().ItemInnerSpacing.x;
    const float width = (ImGui::GetContentRegionAvail().x - 2.0F * gap) / 3.0F;
    for (int i = 0; i < 3; i++) {
        if (i > 0)
            ImGui::SameLine(0.0F, gap);
        ImGui::SetNextItemWidth(width);
        ImGui::PushID(i);
        ImGui::PushStyleColor(ImGuiCol_SliderGrab, is_colour
                                                       ? colour(hues[i], 0.8F)
                                                       : ImGui::GetStyle().Colors[ImGuiCol_SliderGrab]);
        if (slider("##slider", *range, &values[i]))
            changed = i;
        ImGui::PopStyleColor();
        ImGui::PopID();
    }
    ImGui::PopID();
    return changed;
}

bool gui_button(const char *label)
{
    return ImGui::Button(label);
}

void gui_same_line()
{
    ImGui::SameLine();
}

void gui_plot(const float *values, size_t count, double max)
{
    ImGui::PlotLines("##plot", values, static_cast<int>(count), 0, nullptr, 0.0F, static_cast<float>(max),
                     { ImGui::GetContentRegionAvail().x, 1.7F * ImGui::GetTextLineHeight() });
}

bool gui_table_begin(const char *name, const double *widths, size_t column_count)
{
    if (!ImGui::BeginTable(name, static_cast<int>(column_count), ImGuiTableFlags_RowBg))
        return false;
    for (size_t i = 0; i < column_count; i++)
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, static_cast<float>(widths[i]));
    return true;
}

void gui_cell(gui_tone tone, const char *text)
{
    ImGui::TableNextColumn();
    ImGui::PushStyleColor(ImGuiCol_Text, tones[tone]);
    ImGui::TextUnformatted(text);
    ImGui::PopStyleColor();
}

void gui_table_end()
{
    ImGui::EndTable();
}

void gui_tip(const char *text)
{
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
        return;
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(22.0F * ImGui::GetFontSize());
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

void gui_group_begin(size_t number)
{
    ImGui::PushID(static_cast<int>(number));
}

void gui_group_end()
{
    ImGui::PopID();
}

void gui_disabled_begin(bool is_disabled)
{
    ImGui::BeginDisabled(is_disabled);
}

void gui_disabled_end()
{
    ImGui::EndDisabled();
}

bool gui_opener()
{
    ImGui::SetNextWindowPos({ 0.0F, 0.0F });
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, { 2.0F, 2.0F });
    ImGui::Begin("opener", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_AlwaysAutoResize);
    const bool is_pressed = ImGui::Button("»");
    gui_tip("Open the panel (Tab)");
    ImGui::End();
    ImGui::PopStyleVar();
    return is_pressed;
}

/* ---- marks over the picture --------------------------------------------------------------------- */

void gui_mark_size(const char *text, double *width, double *height)
{
    const ImVec2 size = ImGui::CalcTextSize(text), padding = ImGui::GetStyle().FramePadding;
    *width = static_cast<double>(size.x + 2.0F * padding.x);
    *height = static_cast<double>(size.y + 2.0F * padding.y);
}

void gui_mark_text(double x, double y, const char *text)
{
    ImDrawList *const list = ImGui::GetBackgroundDrawList();
    const ImVec2 padding = ImGui::GetStyle().FramePadding;
    double width, height;
    gui_mark_size(text, &width, &height);
    list->AddRectFilled(point(x, y), point(x + width, y + height), packed(0x14161a, 0.75F), 3.0F * scale);
    list->AddText(point(x + static_cast<double>(padding.x), y + static_cast<double>(padding.y)),
                  packed(0xe4e7ea), text);
}

void gui_mark_note(double x, double bottom, double width, gui_tone tone, const char *text)
{
    ImDrawList *const list = ImGui::GetBackgroundDrawList();
    const ImVec2 padding = ImGui::GetStyle().FramePadding;
    const float room = std::max(static_cast<float>(width) - 2.0F * padding.x, 1.0F);
    const ImVec2 size = ImGui::CalcTextSize(text, nullptr, false, room);
    const ImVec2 low = point(x, bottom - static_cast<double>(size.y + 2.0F * padding.y));
    const ImVec2 high = point(x + static_cast<double>(size.x + 2.0F * padding.x), bottom);
    list->AddRectFilled(low, high, packed(0x14161a, 0.85F), 3.0F * scale);
    list->AddText(ImGui::GetFont(), ImGui::GetFontSize(), { low.x + padding.x, low.y + padding.y },
                  ImGui::ColorConvertFloat4ToU32(tones[tone]), text, nullptr, room);
}

void gui_mark_divider(double x, double top, double bottom)
{
    ImDrawList *const list = ImGui::GetBackgroundDrawList();
    const double middle = 0.5 * (top + bottom);
    list->AddLine(point(x, top), point(x, bottom), packed(0x101215, 0.8F), 3.0F * scale);
    list->AddLine(point(x, top), point(x, bottom), packed(0xe4e7ea), scale);
    list->AddCircleFilled(point(x, middle), 9.0F * scale, packed(0xe4e7ea));
    for (const double side : { -1.0, 1.0 }) {
        const double inner = x + side * 2.5 * gui_scale(), outer = x + side * 6.0 * gui_scale();
        const double half = 3.5 * gui_scale();
        list->AddTriangleFilled(point(outer, middle), point(inner, middle - half),
                                point(inner, middle + half), packed(0x1b1e23));
    }
}

void gui_mark_scale(double x, double y, double width, double height, const float *rgb, size_t count,
                    const char *const texts[3])
{
    ImDrawList *const list = ImGui::GetBackgroundDrawList();
    const double step = width / static_cast<double>(count);
    double text_width, text_height;
    gui_mark_size(texts[2], &text_width, &text_height);
    list->AddRectFilled(point(x - text_width, y - 4.0 * gui_scale()),
                        point(x + width + text_width, y + height + text_height), packed(0x14161a, 0.75F),
                        3.0F * scale);
    for (size_t i = 0; i < count; i++) {
        const double left = x + static_cast<double>(i) * step;
        const ImVec4 shown = { rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 1.0F };
        list->AddRectFilled(point(left, y), point(left + step + 0.5, y + height),
                            ImGui::ColorConvertFloat4ToU32(shown));
    }
    for (int i = 0; i < 3; i++) {
        const ImVec2 size = ImGui::CalcTextSize(texts[i]);
        const double middle = x + 0.5 * i * width;
        list->AddText(point(middle - 0.5 * static_cast<double>(size.x), y + height + gui_scale()),
                      packed(0xe4e7ea), texts[i]);
    }
}
