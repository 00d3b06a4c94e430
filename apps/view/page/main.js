// The page of a replay, a live simulation or a search: decodes its data and starts the view.
import style from './style.css';
import {decode} from './data.js';
import {element} from './dom.js';
import {decodeLive} from './live_motion.js';
import {LiveView} from './live_view.js';
import {SearchView, decodeSearch} from './search_view.js';
import {View} from './view.js';

function viewOf(packed) {
  if (packed.live?.search) return new SearchView(decodeSearch(packed));
  return packed.live ? new LiveView(decodeLive(packed)) : new View(decode(packed));
}

function start() {
  document.head.append(element('style', {}, style));
  try {
    const packed = JSON.parse(document.getElementById('replay-data').textContent);
    const view = viewOf(packed);
    window.counterpointReplay = view;
    view.start();
  } catch (error) {
    console.error(error);
    document.body.append(element('p', {class: 'failed'},
      `This replay cannot be shown: ${error.message}. It needs a browser with WebGL 2.`));
  }
}

start();
