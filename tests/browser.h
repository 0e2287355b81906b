/*
 * A headless browser under the DevTools protocol: messages of JSON, each ended by a NUL, through two pipes
 * that it has as descriptors 3 and 4.
 */
#ifndef BROWSER_H
#define BROWSER_H

#include "tests/check.h"

#include <fcntl.h>
#include <jansson.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

struct browser {
    pid_t process;
    FILE *to, *from;
    int number; /* of the last message */
    char session[128];
};

/* Send a command and wait for its result, which the caller releases. parameters is taken. */
static inline json_t *browser_ask(struct browser *browser, const char *method, json_t *parameters)
{
    const int number = ++browser->number;
    json_t *const message = json_pack("{s:i, s:s, s:o, s:s*}", "id", number, "method", method, "params",
                                      parameters, "sessionId", *browser->session ? browser->session : NULL);
    assert_non_null(message);
    char *const text = json_dumps(message, JSON_COMPACT);
    assert_int_equal(fwrite(text, 1, strlen(text) + 1, browser->to), strlen(text) + 1);
    assert_int_equal(fflush(browser->to), 0);
    free(text);
    json_decref(message);
    char *line = NULL;
    size_t capacity = 0;
    for (;;) {
        const ssize_t size = getdelim(&line, &capacity, '\0', browser->from);
        if (size <= 0)
            fail_msg("the browser ended at %s", method);
        json_t *const answer = json_loads(line, 0, NULL);
        assert_non_null(answer);
        if (json_integer_value(json_object_get(answer, "id")) == number) {
            json_t *const result = json_incref(json_object_get(answer, "result"));
            if (!result)
                fail_msg("%s: %s", method, line);
            json_decref(answer);
            free(line);
            return result;
        }
        json_decref(answer); /* an event */
    }
}

/* Open a page of that size. */
static inline void browser_start(struct browser *browser, const char *url, int width_px, int height_px)
{
    int commands[2], answers[2];
    *browser = (struct browser){ .number = 0 };
    assert_int_equal(pipe(commands), 0);
    assert_int_equal(pipe(answers), 0);
    browser->process = fork();
    assert_true(browser->process >= 0);
    if (browser->process == 0) {
        /* out of the way of 3 and 4 first */
        const int in = fcntl(commands[0], F_DUPFD, 10), out = fcntl(answers[1], F_DUPFD, 10),
                  nowhere = open("/dev/null", O_RDWR);
        dup2(nowhere, 0);
        dup2(nowhere, 1);
        dup2(nowhere, 2);
        dup2(in, 3);
        dup2(out, 4);
        for (int other = 5; other < 64; other++)
            close(other);
        execlp("chromium-headless-shell", "chromium-headless-shell", "--no-sandbox", "--disable-gpu",
               "--disable-dev-shm-usage", "--hide-scrollbars", "--remote-debugging-pipe", (char *)NULL);
        _exit(127);
    }
    close(commands[0]);
    close(answers[1]);
    browser->to = fdopen(commands[1], "w");
    browser->from = fdopen(answers[0], "r");
    json_t *result = browser_ask(
        browser, "Target.createTarget",
        json_pack("{s:s, s:i, s:i}", "url", "about:blank", "width", width_px, "height", height_px));
    json_t *const session =
        browser_ask(browser, "Target.attachToTarget",
                    json_pack("{s:s, s:b}", "targetId",
                              json_string_value(json_object_get(result, "targetId")), "flatten", 1));
    snprintf(browser->session, sizeof browser->session, "%s",
             json_string_value(json_object_get(session, "sessionId")));
    json_decref(session);
    json_decref(result);
    json_decref(browser_ask(browser, "Page.navigate", json_pack("{s:s}", "url", url)));
}

/* What a piece of JavaScript gives, as text, into out; promises are waited for. */
static inline void browser_run(struct browser *browser, const char *script, char *out, size_t size)
{
    json_t *const result = browser_ask(
        browser, "Runtime.evaluate",
        json_pack("{s:s, s:b, s:b}", "expression", script, "returnByValue", 1, "awaitPromise", 1));
    if (json_object_get(result, "exceptionDetails")) {
        char *const text = json_dumps(result, 0);
        fail_msg("%s: %s", script, text);
    }
    const json_t *const value = json_object_get(json_object_get(result, "result"), "value");
    if (json_is_string(value))
        snprintf(out, size, "%s", json_string_value(value));
    else
        snprintf(out, size, "%.17g", json_is_true(value) ? 1 : json_number_value(value));
    json_decref(result);
}

static inline double browser_number(struct browser *browser, const char *script)
{
    char text[256];
    browser_run(browser, script, text, sizeof text);
    return strtod(text, NULL);
}

static inline void browser_wait_for(struct browser *browser, const char *script)
{
    for (int i = 0; i < 600; i++) {
        if (browser_number(browser, script) != 0)
            return;
        usleep(50000);
    }
    fail_msg("still not so after half a minute: %s", script);
}

/* The mouse to a place of the window; kind: "mouseMoved", "mousePressed" or "mouseReleased". */
static inline void browser_mouse(struct browser *browser, const char *kind, double x_px, double y_px)
{
    const bool is_button = strcmp(kind, "mouseMoved") != 0;
    json_decref(
        browser_ask(browser, "Input.dispatchMouseEvent",
                    json_pack("{s:s, s:f, s:f, s:s, s:i}", "type", kind, "x", x_px, "y", y_px, "button",
                              is_button ? "left" : "none", "clickCount", is_button ? 1 : 0)));
}

/* A PNG of the window, its bytes in base64; the caller frees it. */
static inline char *browser_screenshot(struct browser *browser)
{
    json_t *const result = browser_ask(browser, "Page.captureScreenshot", json_object());
    char *const data = strdup(json_string_value(json_object_get(result, "data")));
    json_decref(result);
    return data;
}

static inline void browser_end(struct browser *browser)
{
    fclose(browser->to); /* ends it */
    fclose(browser->from);
    kill(browser->process, SIGTERM);
    waitpid(browser->process, NULL, 0);
}

#endif
