"""What makes a page hard for readers of screens and keyboards: the static part of what axe checks."""

import re
from collections import Counter
from html.parser import HTMLParser
from itertools import pairwise

VOID = {"meta", "link", "img", "input", "br", "path", "circle", "hr"}
FOCUSABLE = {"a", "button", "select", "input", "summary"}
MADE_FOCUSABLE = "results"  # tables.js gives these tables buttons


class Page(HTMLParser):
    """Every element with its attributes, text, and the elements around it."""

    def __init__(self, html):
        super().__init__()
        self.open, self.elements = [], []
        self.feed(re.sub(r"(?s)<script.*?</script>|<style.*?</style>", "", html))

    def handle_starttag(self, tag, attributes):
        element = {"tag": tag, "text": "", "above": list(self.open), **dict(attributes)}
        self.elements.append(element)
        if tag not in VOID:
            self.open.append(element)

    handle_startendtag = handle_starttag

    def handle_endtag(self, tag):
        while self.open and self.open.pop()["tag"] != tag:
            pass

    def handle_data(self, text):
        for element in self.open:
            element["text"] += text

    def of(self, *tags):
        return [element for element in self.elements if element["tag"] in tags]

    def below(self, element):
        return [other for other in self.elements if any(element is above for above in other["above"])]


def faults_of(html):
    """The faults of a page, in words."""
    page, faults = Page(html), []
    if [element.get("lang") for element in page.of("html")] != ["en"]:
        faults.append("no language")
    if not "".join(element["text"] for element in page.of("title")).strip():
        faults.append("no title")
    landmarks = Counter(element["tag"] for element in page.of("main"))
    if landmarks["main"] != 1:
        faults.append(f"{landmarks['main']} main landmarks")
    levels = [int(element["tag"][1]) for element in page.of("h1", "h2", "h3", "h4")]
    if levels.count(1) != 1:
        faults.append("not one h1")
    faults += [f"h{low} is followed by h{high}" for low, high in pairwise(levels) if high > low + 1]
    faults += [f"id {name} twice" for name, count in Counter(map(_id, page.elements)).items() if name and count > 1]
    faults += [f"image without words: {image.get('src')}" for image in page.of("img") if not image.get("alt")]
    for head in page.of("th"):
        if head.get("scope") not in ("col", "row", "rowgroup"):
            faults.append(f"head without scope: {head['text']}")
    for field in page.of("input", "select", "textarea"):
        labeled = any(above["tag"] == "label" for above in field["above"]) or field.get("aria-label")
        if not labeled and _id(field) not in [label.get("for") for label in page.of("label")]:
            faults.append(f"field without label: {field}")
    for element in page.of("a", "button", "summary"):
        images = [other for other in page.below(element) if other.get("alt")]
        if not (element["text"].strip() or element.get("aria-label") or images):
            faults.append(f"{element['tag']} without words")
    for element in page.elements:
        if element.get("role") == "img" and not element.get("aria-label"):
            faults.append(f"{element['tag']} without words")
        if element["tag"] == "pre" or "scroll" in (element.get("class") or "").split():
            inside = [element, *page.below(element)]
            if not any(
                other["tag"] in FOCUSABLE or "tabindex" in other or MADE_FOCUSABLE in (other.get("class") or "")
                for other in inside
            ):
                faults.append(f"box that scrolls and takes no focus: {element['tag']}")
    return faults + faint(html)


def _id(element):
    return element.get("id")


def faint(html):
    """Pairs of the style's colors for text and ground with a contrast below 4.5, in light and in dark."""
    style = "".join(re.findall(r"(?s)<style>(.*?)</style>", html))
    faults, colors = [], {"paper": "#fff"}
    for block in re.findall(r":root\s*{(.*?)}", style, re.DOTALL):
        colors = colors | dict(re.findall(r"--([a-z-]+):\s*(#[0-9a-f]{3,6})\b", block))
        grounds = {"paper": ("ink", "soft", "link", "good", "near", "bad"), "pale": ("ink", "soft", "link")}
        grounds |= {"tint": ("ink", "link"), "warm": ("ink",)}
        grounds |= {f"{tone}-tint": (tone,) for tone in ("good", "near", "bad")}
        for ground, texts in grounds.items():
            for text in texts:
                if {ground, text} <= colors.keys() and contrast(colors[ground], colors[text]) < 4.5:
                    faults.append(f"{text} on {ground} is faint")
    return faults


def contrast(one, other):
    """The ratio of luminances of two colors, as WCAG defines it."""
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(color):
    digits = color[1:] if len(color) == 7 else "".join(2 * digit for digit in color[1:])
    shares = [int(digits[place : place + 2], 16) / 255 for place in (0, 2, 4)]
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
