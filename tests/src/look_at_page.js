'use strict';
// What a reader would see go wrong, as JSON in the document.
const PHONE = 390;

const all = (root, selector) => [...root.querySelectorAll(selector)];
const where = element => element.closest('figure')?.id || element.id || element.tagName;

function pictures(root) {
  const wrong = [];
  for (const svg of all(root, 'svg')) {
    const box = svg.getBoundingClientRect();
    if (!(box.width > 0 && box.height > 0)) {
      wrong.push(`${where(svg)}: a picture of ${box.width} x ${box.height}`);
      continue;
    }
    for (const text of all(svg, 'text')) {
      const at = text.getBoundingClientRect();
      const inside = at.left >= box.left - 1 && at.right <= box.right + 1 && at.top >= box.top - 1 && at.bottom <= box.bottom + 1;
      if (!inside) wrong.push(`${where(svg)}: '${text.textContent}' is cut off`);
    }
  }
  return wrong;
}

// What stands out to the right of the page and does not scroll by itself.
function wide(root, width) {
  const contained = element => element.parentElement?.closest('.scroll') || element.closest('svg');
  return all(root, 'body *')
    .filter(element => !contained(element) && element.getBoundingClientRect().right > width + 0.5)
    .map(element => `${where(element)} '${element.textContent.trim().slice(0, 40)}' at ${width} px`);
}

function sideways(root, width) {
  const page = root.documentElement;
  const wrong = wide(root, width);
  if (page.scrollWidth > page.clientWidth) wrong.push(`the page is ${page.scrollWidth} px wide at ${page.clientWidth} px`);
  return wrong;
}

function phone() {
  const copy = document.documentElement.cloneNode(true);
  all(copy, 'script').forEach(script => script.remove());
  const frame = document.createElement('iframe');
  frame.style.cssText = `width: ${PHONE}px; height: 800px; border: 0`;
  frame.srcdoc = `<!DOCTYPE html>${copy.outerHTML}`;
  return new Promise(done => {
    frame.onload = () => {
      const inner = frame.contentDocument;
      const ready = inner.documentElement.clientWidth === PHONE && inner.body.childElementCount > 0;
      done([...(ready ? [] : ['the narrow copy is not there']), ...sideways(inner, PHONE), ...pictures(inner)]);
    };
    document.body.append(frame);
  });
}

addEventListener('load', async () => {
  const links = all(document, 'a[href]').map(link => link.getAttribute('href'));
  const images = all(document, 'img');
  found.figures = all(document, 'figure').length;
  found.pictures = all(document, 'svg').length;
  found.figure_ids = all(document, 'figure').map(figure => figure.id);
  found.links = links.length;
  found.dead_links = links.filter(link => !link.startsWith('#') || !document.getElementById(link.slice(1)));
  found.broken_images = images.filter(image => !image.complete || image.naturalWidth === 0).map(image => image.src);
  found.broken_pictures = pictures(document);
  found.sideways = sideways(document, document.documentElement.clientWidth);
  found.phone = await phone();
  const result = document.createElement('script');
  result.type = 'application/json';
  result.id = 'findings';
  result.textContent = JSON.stringify(found).replaceAll('<', '\\u003c');
  document.body.append(result);
});
