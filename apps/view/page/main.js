// The page of a replay or of a live simulation: decodes its data and starts the view.
import style from './style.css';
import {decode} from './data.js';
import {element} from './dom.js';
import {decodeLive} from './live_motion.js';
import {LiveView} from './live_view.js';
import {View} from './view.js';

function start() {
  document.head.append(element('style', {}, style));
  try {
    const packed = JSON.parse(document.getElementById('replay-data').textContent);
    const view = packed.live ? new LiveView(decodeLive(packed)) : new View(decode(packed));
    window.counterpointReplay = view;
    view.start();
  } catch (error) {
    console.error(error);
    document.body.append(element('p', {class: 'failed'},
      `This replay cannot be shown: ${error.message}. It needs a browser with WebGL 2.`));
  }
}

start();
