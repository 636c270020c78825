#!/usr/bin/python3
"""Links in the repository's Markdown lead to files that exist and headings that exist. Links to other sites are not followed.

    links_test.py ROOT
"""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1]).resolve()
pages = [path for path in root.rglob("*.md") if not {"build", ".git", "out", "node_modules"} & set(path.relative_to(root).parts)]


def without_code(text):
    return re.sub(r"^```.*?^```$|`[^`\n]*`", "", text, flags=re.M | re.S)


def anchors(path):
    """The names that GitHub and MkDocs give to headings."""
    headings = re.findall(r"^#+ +(.*)$", re.sub(r"^```.*?^```$", "", path.read_text(), flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


broken, count = [], 0
for page in pages:
    for target in re.findall(r"\]\(([^)\s]+)\)", without_code(page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        count += 1
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists():
            broken.append(f"{page.relative_to(root)}: {target}: no such file")
        elif anchor and file.suffix == ".md" and anchor not in anchors(file):
            broken.append(f"{page.relative_to(root)}: {target}: no such heading")
print("\n".join(broken) or f"{count} links in {len(pages)} pages")
sys.exit(1 if broken or count < 10 else 0)
