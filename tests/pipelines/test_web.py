"""Dagster's web UI on a studio, in a real browser: a person can look at clips, beats and dances."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.browser]


@pytest.fixture
def page_of(studio, tmp_path):
    """Serve a copy of the built studio; return its address and a headless browser."""
    if not shutil.which("chromium") or not shutil.which("chromedriver"):
        pytest.skip("no chromium and chromedriver here; Debian's packages chromium and chromium-driver bring them")
    from selenium import webdriver

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-m", "pipelines.cli", "ui", "--studio", str(studio), "--port", str(port)],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    address = f"http://127.0.0.1:{port}"
    options = webdriver.ChromeOptions()
    for flag in (
        *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
        *("--disable-background-networking", "--disable-component-update", "--window-size=1600,1200"),
        f"--user-data-dir={tmp_path / 'browser'}",
    ):
        options.add_argument(flag)
    browser = None
    try:
        deadline = time.monotonic() + 120
        while True:
            try:
                urllib.request.urlopen(f"{address}/server_info", timeout=5).close()
                break
            except OSError:
                assert server.poll() is None, "the server ended"
                assert time.monotonic() < deadline, "the server did not answer"
                time.sleep(0.5)
        browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
        yield address, browser
    finally:
        if browser is not None:
            browser.quit()
        server.send_signal(signal.SIGTERM)
        assert server.wait(30) == 0


def see(browser, address, text, *, seconds=60):
    """Open a page and wait until it shows a text."""
    browser.get(address)
    deadline = time.monotonic() + seconds
    while text not in browser.page_source:
        assert time.monotonic() < deadline, f"{address} never showed {text!r}"
        time.sleep(0.3)


def pictures(browser):
    """Open the first Markdown entry of the page and return the widths of its pictures, and its text."""
    from selenium.webdriver.common.by import By

    browser.find_element(By.XPATH, "//*[contains(text(), 'Show Markdown')]").click()
    time.sleep(2)
    widths = browser.execute_script(
        "return Array.from(document.querySelectorAll('img')).filter(i => i.src.startsWith('data:image/png'))"
        ".map(i => i.naturalWidth)"
    )
    return widths, browser.find_element(By.TAG_NAME, "body").text


def test_a_person_can_look_at_clips_beats_and_a_dance(page_of, tmp_path):
    address, browser = page_of
    see(browser, f"{address}/asset-groups/", "capture")
    see(browser, f"{address}/assets/motion_beat?view=partitions&partition=ayame", "Show Markdown")
    widths, text = pictures(browser)
    assert widths
    assert min(widths) > 300
    assert "ayame-twist" in text
    see(browser, f"{address}/assets/music_beat?view=partitions&partition=beat", "Show Markdown")
    assert min(pictures(browser)[0]) > 300
    see(browser, f"{address}/assets/dance_quality?view=partitions&partition=graph%7Cbeat", "Show Markdown")
    widths, text = pictures(browser)
    assert min(widths) > 300
    assert "seam_jerk_ratio" in text
    shot = tmp_path / "dance.png"
    browser.save_screenshot(str(shot))
    assert shot.stat().st_size > 20_000
    if folder := os.environ.get("ODORI_SCREENSHOTS"):
        shutil.copy(shot, folder)
    see(browser, f"{address}/automation", "source_sensor")
    assert "nightly" in browser.page_source
